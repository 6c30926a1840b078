#include "tools/draw/map_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/imgproc.hpp>

#include "tools/draw/colors.hpp"

namespace dlod::tools {
namespace {

constexpr int kLargerSide = 1400;  // pixels
constexpr double kMargin_m = 2.0;
constexpr double kShareShown = 0.995;  // of the map's points along each axis: single far ones do not shrink the rest
constexpr double kGrid_m = 10.0;

using Path = std::vector<Eigen::Vector3d>;

/// The part of the world that is shown, and its scale.
class View {
  public:
    View(const PointList& map, const Path& trajectory) {
        for (const int axis : {0, 1}) {
            std::vector<double> values;
            values.reserve(map.size());
            for (const auto& p : map) values.push_back(p[axis]);
            const auto at = [&](double share) {
                const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
                std::nth_element(values.begin(), values.begin() + k, values.end());
                return values[static_cast<std::size_t>(k)];
            };
            double low = values.empty() ? 1e9 : at(1.0 - kShareShown);
            double high = values.empty() ? -1e9 : at(kShareShown);
            for (const auto& p : trajectory) {
                low = std::min(low, p[axis]);
                high = std::max(high, p[axis]);
            }
            low_[axis] = low - kMargin_m;
            high_[axis] = high + kMargin_m;
        }
        scale_ = kLargerSide / (high_ - low_).maxCoeff();
    }

    cv::Size size() const { return {cvCeil(scale_ * (high_.x() - low_.x())), cvCeil(scale_ * (high_.y() - low_.y()))}; }
    double scale() const { return scale_; }
    const Eigen::Vector2d& low() const { return low_; }
    const Eigen::Vector2d& high() const { return high_; }
    /// y points up in the picture.
    cv::Point at(const Eigen::Vector3d& p) const {
        return {cvRound(scale_ * (p.x() - low_.x())), cvRound(scale_ * (high_.y() - p.y()))};
    }

  private:
    Eigen::Vector2d low_, high_;
    double scale_ = 1.0;
};

void draw_points(cv::Mat& picture, const View& view, const PointList& map) {
    if (map.empty()) return;
    std::vector<double> heights;
    for (const auto& p : map) heights.push_back(p.z());
    std::sort(heights.begin(), heights.end());
    const double floor_m = heights[heights.size() / 50];
    cv::Mat1f height(picture.size(), -1e9F);
    const cv::Rect inside({0, 0}, picture.size());
    for (const auto& p : map) {
        const cv::Point at = view.at(p);
        if (inside.contains(at)) height(at) = std::max(height(at), static_cast<float>(p.z() - floor_m));
    }
    const int radius = std::max(1, cvRound(0.05 * view.scale()));
    cv::dilate(height, height, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}));
    for (int r = 0; r < picture.rows; ++r) {
        for (int c = 0; c < picture.cols; ++c) {
            if (height(r, c) < -1e8F) continue;
            // From light gray on the ground to dark at 3 m and above.
            const double s = std::clamp(static_cast<double>(height(r, c)) / 3.0, 0.0, 1.0);
            const auto gray = static_cast<std::uint8_t>(std::lround(232.0 - 150.0 * s));
            picture.at<cv::Vec3b>(r, c) = {gray, gray, gray};
        }
    }
}

void draw_grid(cv::Mat& picture, const View& view) {
    for (const int axis : {0, 1}) {
        for (double v = std::ceil(view.low()[axis] / kGrid_m) * kGrid_m; v < view.high()[axis]; v += kGrid_m) {
            Eigen::Vector3d from = Eigen::Vector3d::Zero();
            from.head<2>() = view.low();
            Eigen::Vector3d to = Eigen::Vector3d::Zero();
            to.head<2>() = view.high();
            from[axis] = to[axis] = v;
            cv::line(picture, view.at(from), view.at(to), cv::Scalar(225, 225, 225), 1);
            char text[24];
            std::snprintf(text, sizeof text, "%.0f m", v);
            const cv::Point label =
                axis == 0 ? cv::Point(view.at(from).x + 3, picture.rows - 6) : cv::Point(4, view.at(from).y - 4);
            cv::putText(picture, text, label, cv::FONT_HERSHEY_SIMPLEX, 0.4, cv::Scalar(150, 150, 150), 1, cv::LINE_AA);
        }
    }
}

void draw_path(cv::Mat& picture, const View& view, const Path& path, const cv::Scalar& color, int thickness) {
    for (std::size_t i = 1; i < path.size(); ++i)
        cv::line(picture, view.at(path[i - 1]), view.at(path[i]), color, thickness, cv::LINE_AA);
}

void draw_footprint(cv::Mat& picture, const View& view, const OrientedBox& box, const cv::Scalar& color) {
    const Eigen::AngleAxisd turn(box.yaw_rad, Eigen::Vector3d::UnitZ());
    Path corners;
    for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}, {-0.5, -0.5}}) {
        corners.push_back(box.center_m + turn * Eigen::Vector3d(x * box.size_m.x(), y * box.size_m.y(), 0.0));
    }
    draw_path(picture, view, corners, color, 2);
}

void draw_tracks(cv::Mat& picture, const View& view, const RunOutput& run) {
    std::map<std::uint32_t, Path> paths;
    std::map<std::uint32_t, Track> last;
    for (const auto& [seq, tracks] : run.tracks) {
        for (const auto& track : tracks) {
            if (track.state != DynamicState::kDynamic) continue;
            paths[track.id].push_back(track.box.center_m);
            last[track.id] = track;
        }
    }
    for (const auto& [id, path] : paths) {
        const cv::Scalar color = color_of_id(id);
        draw_path(picture, view, path, color, 2);
        draw_footprint(picture, view, last[id].box, color);
        cv::putText(picture, std::to_string(id), view.at(path.back()) + cv::Point(8, -8), cv::FONT_HERSHEY_SIMPLEX, 0.5,
                    color, 1, cv::LINE_AA);
    }
}

void draw_true_paths(cv::Mat& picture, const View& view, const TruePaths& paths) {
    Path sensor;
    for (const auto& pose : paths.truth.sensor) sensor.push_back(paths.T_run_true * pose.T_world_sensor.translation());
    draw_path(picture, view, sensor, kTruePath, 6);
    std::map<int, Path> objects;
    for (const auto& frame : paths.truth.objects) {
        for (const auto& object : frame) {
            if (object.ever_moves) objects[object.id].push_back(paths.T_run_true * object.center_m);
        }
    }
    for (const auto& [id, path] : objects) draw_path(picture, view, path, cv::Scalar(170, 210, 170), 5);
}

void draw_legend(cv::Mat& picture, const std::string& title, bool with_truth) {
    const auto line = [&](int row, const std::string& text, const cv::Scalar& color) {
        cv::putText(picture, text, {12, 28 + 22 * row}, cv::FONT_HERSHEY_SIMPLEX, 0.6, color, 1, cv::LINE_AA);
    };
    cv::rectangle(picture, {4, 6},
                  {24 + 11 * static_cast<int>(std::max<std::size_t>(title.size(), 34)), with_truth ? 104 : 82}, kWhite,
                  cv::FILLED);
    line(0, title, kText);
    line(1, "trajectory of the sensor", kRunPath);
    line(2, "dynamic tracks, each in its colour", color_of_id(1));
    if (with_truth) line(3, "truth: sensor, moving objects", kTruePath);
}

}  // namespace

cv::Mat draw_from_above(const RunOutput& run, const PointList& map, const std::optional<TruePaths>& paths,
                        const std::string& title) {
    Path trajectory;
    for (const auto& pose : run.trajectory) trajectory.push_back(pose.T_world_sensor.translation());
    const View view(map, trajectory);
    cv::Mat picture(view.size(), CV_8UC3, kWhite);
    draw_grid(picture, view);
    if (paths) draw_true_paths(picture, view, *paths);  // beneath the points: ghosts along them stay visible
    draw_points(picture, view, map);
    draw_tracks(picture, view, run);
    draw_path(picture, view, trajectory, kRunPath, 2);
    cv::circle(picture, view.at(trajectory.back()), 6, kRunPath, cv::FILLED, cv::LINE_AA);
    draw_legend(picture, title, paths.has_value());
    return picture;
}

}  // namespace dlod::tools
