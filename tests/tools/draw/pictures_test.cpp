#include <gtest/gtest.h>

#include "tests/support/rendered_scene.hpp"
#include "tests/tools/eval/small_drive.hpp"
#include "tools/draw/box_edges.hpp"
#include "tools/draw/colors.hpp"
#include "tools/draw/frame_pictures.hpp"
#include "tools/draw/map_picture.hpp"

namespace dlod::tools {
namespace {

constexpr int kRows = 64;
constexpr int kColumns = 512;

/// A box of 1 m x 1 m x 2 m, 6 m before the sensor, on the ground 1 m below it.
class FramePictures : public ::testing::Test {
  protected:
    FramePictures() : sensor_(dlod::test::even_sensor(kRows, kColumns, 0.7, -0.7)), frame_(sensor_) {
        const Eigen::Vector3d low(5.5, -0.5, -1.0);
        const Eigen::Vector3d high(6.5, 0.5, 1.0);
        dlod::test::render(
            sensor_,
            [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
                return dlod::test::nearest(dlod::test::box_range(low, high, o, d),
                                           dlod::test::plane_range(-Eigen::Vector3d::UnitZ(), 1.0, o, d));
            },
            Eigen::Isometry3d::Identity(), frame_);
        for (std::size_t i = 0; i < sensor_.pixels(); ++i) {
            const Eigen::Vector3f p(frame_.cloud.x[i], frame_.cloud.y[i], frame_.cloud.z[i]);
            const bool on_box = p.z() > -0.99F && p.x() > 5.4F && p.x() < 6.6F && std::abs(p.y()) < 0.6F;
            if (on_box) box_pixels_.push_back(i);
            frame_.detection.label[i] = static_cast<std::uint8_t>(on_box ? PixelLabel::kDynamic : PixelLabel::kStatic);
        }
        track_.id = 7;
        track_.state = DynamicState::kDynamic;
        track_.box.center_m = 0.5 * (low + high);
        track_.box.size_m = high - low;
    }

    cv::Vec3b color_at(const cv::Mat& picture, std::size_t pixel) const {
        const int row = static_cast<int>(pixel) / kColumns;
        const int column = static_cast<int>(pixel) % kColumns;
        return picture.at<cv::Vec3b>((2 * row + 1) * picture.rows / (2 * kRows),
                                     (2 * column + 1) * picture.cols / (2 * kColumns));
    }

    SensorModel sensor_;
    Frame frame_;
    Track track_;
    std::vector<std::size_t> box_pixels_;
};

TEST_F(FramePictures, DynamicPixelsAreRedAndOthersGray) {
    ASSERT_GT(box_pixels_.size(), 100U);
    const cv::Mat picture = draw_range_image(frame_, sensor_);
    for (const std::size_t pixel : box_pixels_) {
        const cv::Vec3b color = color_at(picture, pixel);
        ASSERT_GT(color[2], color[0] + 80) << pixel;
    }
    const std::size_t ground = static_cast<std::size_t>(kRows - 8) * kColumns + 20;
    ASSERT_GT(frame_.cloud.range_m[ground], 0.0F);
    const cv::Vec3b gray = color_at(picture, ground);
    EXPECT_EQ(gray[0], gray[1]);
    EXPECT_EQ(gray[1], gray[2]);
    EXPECT_GT(gray[0], 0);
}

TEST_F(FramePictures, EdgesOfABoxEncloseItsPixelsClosely) {
    cv::Rect bounds;
    for (const auto& edge : box_edges(track_, sensor_, frame_)) {
        for (const cv::Point& p : edge) bounds |= cv::Rect(p, cv::Size(1, 1));
    }
    cv::Rect seen;
    for (const std::size_t pixel : box_pixels_) {
        seen |= cv::Rect(static_cast<int>(pixel) % kColumns, static_cast<int>(pixel) / kColumns, 1, 1);
    }
    EXPECT_NEAR(bounds.x, seen.x, 2);
    EXPECT_NEAR(bounds.y, seen.y, 2);
    EXPECT_NEAR(bounds.br().x, seen.br().x, 2);
    EXPECT_NEAR(bounds.br().y, seen.br().y, 2);
}

TEST_F(FramePictures, EdgesFollowAnObjectBackToTheTimeOfItsColumns) {
    // The whole frame was fired 0.1 s before its stamp; since then the object has moved 1 m to the left.
    frame_.header.stamp_ns = 1'000'000'000;
    std::fill(frame_.columns.time_ns.begin(), frame_.columns.time_ns.end(), 900'000'000);
    const auto at_rest = box_edges(track_, sensor_, frame_);
    track_.velocity_mps = {0.0, 10.0, 0.0};
    track_.box.center_m.y() += 1.0;
    const auto moved = box_edges(track_, sensor_, frame_);
    ASSERT_EQ(at_rest.size(), moved.size());
    for (std::size_t i = 0; i < moved.size(); ++i) {
        ASSERT_EQ(at_rest[i].size(), moved[i].size());
        for (std::size_t k = 0; k < moved[i].size(); ++k) {
            EXPECT_NEAR(at_rest[i][k].x, moved[i][k].x, 2);
            EXPECT_NEAR(at_rest[i][k].y, moved[i][k].y, 2);
        }
    }
}

TEST(ResidualPicture, LargeResidualsAreBright) {
    Image<float> residual_m(kRows, kColumns, 0.0F);
    residual_m(32, 256) = 0.5F;
    const cv::Mat picture = draw_residual_image(residual_m, 0.5);
    const cv::Scalar bright(picture.at<cv::Vec3b>(65 * picture.rows / 128, 513 * picture.cols / 1024));
    const cv::Scalar dark(picture.at<cv::Vec3b>(20, 20));
    EXPECT_GT(bright[0] + bright[1] + bright[2], dark[0] + dark[1] + dark[2] + 300.0);
}

TEST(MapPicture, ShowsTheTrajectoryAndTheTracks) {
    const test::SmallDrive drive;
    drive.write();
    const RunOutput run(drive.run_folder);
    const cv::Mat picture = draw_from_above(run, read_pcd(drive.run_folder / "map.pcd"), std::nullopt, "small");
    const auto pixels_of = [&](const cv::Scalar& color) {
        int count = 0;
        for (int r = 140; r < picture.rows; ++r) {  // below the legend, which has the same colours
            for (int c = 0; c < picture.cols; ++c) count += cv::Scalar(picture.at<cv::Vec3b>(r, c)) == color ? 1 : 0;
        }
        return count;
    };
    EXPECT_GT(pixels_of(kRunPath), 50);
    EXPECT_GT(pixels_of(color_of_id(11)), 50);
    EXPECT_GT(pixels_of(color_of_id(12)), 50);
    EXPECT_EQ(pixels_of(color_of_id(99)), 0);
}

}  // namespace
}  // namespace dlod::tools
