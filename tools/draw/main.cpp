// dlod-draw: pictures of a replay's output folder.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "daemon/commands/load_config.hpp"
#include "tools/command_line.hpp"
#include "tools/draw/colors.hpp"
#include "tools/draw/frame_pictures.hpp"
#include "tools/draw/map_picture.hpp"
#include "tools/draw/replayed_frame.hpp"
#include "tools/eval/csv_table.hpp"

namespace dlod::tools {
namespace {

struct Arguments {
    std::filesystem::path run, beside, out, truth, capture, metadata, config;
    std::vector<std::string> settings;
    std::int64_t frame = -1;
    double residual_scale_m = 0.5;
    std::string title, beside_title;
};

void save(const Arguments& arguments, const char* name, const cv::Mat& picture) {
    const auto file = arguments.out / name;
    if (!cv::imwrite(file.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 9})) {
        throw std::runtime_error(file.string() + ": cannot be written");
    }
    std::printf("%s\n", file.c_str());
}

/// The frame with the most dynamic points.
std::int64_t busiest_frame(const std::filesystem::path& run) {
    const CsvTable frames(run / "frames.csv");
    const auto seq = frames.column("seq");
    const auto points = frames.column("dynamic_points");
    std::int64_t best = 0;
    std::int64_t most = -1;
    for (std::size_t row = 0; row < frames.rows(); ++row) {
        if (frames.integer(row, points) <= most) continue;
        most = frames.integer(row, points);
        best = frames.integer(row, seq);
    }
    return best;
}

void draw_frame(const Arguments& arguments) {
    const driver::SensorInfo sensor = driver::load_metadata(arguments.metadata);
    daemon::ConfigSources sources;
    if (!arguments.config.empty()) sources.file = arguments.config;
    sources.settings = arguments.settings;
    const daemon::Config config = daemon::load_config(sources, &sensor);
    const std::int64_t sequence = arguments.frame >= 0 ? arguments.frame : busiest_frame(arguments.run);
    const ReplayedFrame replayed =
        replay_to(static_cast<std::uint64_t>(sequence), arguments.capture, sensor, config.frames, config.method);
    save(arguments, "range_image.png", draw_range_image(replayed.frame, sensor.model));
    save(arguments, "residual_image.png", draw_residual_image(replayed.residual_m, arguments.residual_scale_m));
}

cv::Mat draw_map(const std::filesystem::path& folder, const std::filesystem::path& truth_folder,
                 const std::string& title) {
    const RunOutput run(folder);
    const auto file = folder / "map.pcd";
    const PointList map = std::filesystem::exists(file) ? read_pcd(file) : PointList{};
    const std::string caption = title.empty() ? folder.string() : title;
    if (truth_folder.empty()) return draw_from_above(run, map, std::nullopt, caption);
    const Truth truth(truth_folder);
    const Eigen::Isometry3d T_true_run = score_trajectory(truth, run.trajectory).T_true_run;
    return draw_from_above(run, map, TruePaths{truth, T_true_run.inverse()}, caption);
}

void draw_maps(const Arguments& arguments) {
    cv::Mat picture = draw_map(arguments.run, arguments.truth, arguments.title);
    if (!arguments.beside.empty()) {
        cv::Mat beside = draw_map(arguments.beside, arguments.truth, arguments.beside_title);
        const int rows = std::max(picture.rows, beside.rows);
        for (auto* side : {&picture, &beside}) {
            cv::copyMakeBorder(*side, *side, 0, rows - side->rows, 6, 6, cv::BORDER_CONSTANT, kWhite);
        }
        cv::hconcat(picture, beside, picture);
    }
    save(arguments, "from_above.png", picture);
}

}  // namespace
}  // namespace dlod::tools

int main(int argc, char** argv) {
    using namespace dlod::tools;
    CLI::App app{
        "Draws the output folder of `dlod replay`: trajectory, tracks and map from above; with the capture also one "
        "frame's range image with dynamic mask and track boxes, and its residual image."};
    Arguments arguments;
    app.add_option("RUN_DIR", arguments.run, "output folder of the replay")->required()->check(CLI::ExistingDirectory);
    app.add_option("--out", arguments.out, "folder for the pictures")->required();
    app.add_option("--truth", arguments.truth, "truth folder of the drive, for the true paths")
        ->check(CLI::ExistingDirectory);
    app.add_option("--pcap", arguments.capture, "capture that was replayed")->check(CLI::ExistingFile);
    app.add_option("--metadata", arguments.metadata, "the sensor's metadata; default: the capture's name with .json");
    app.add_option("-c,--config", arguments.config, "configuration of the replay")->check(CLI::ExistingFile);
    app.add_option("--set", arguments.settings, "key=value, as in the replay");
    app.add_option("--frame", arguments.frame,
                   "seq of the frame to draw; default: the one with the most dynamic points");
    app.add_option("--residual-scale", arguments.residual_scale_m, "residual that is drawn brightest, metres")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--title", arguments.title, "caption of the view from above; default: RUN_DIR");
    app.add_option("--beside", arguments.beside, "output folder of another run, drawn from above beside the first")
        ->check(CLI::ExistingDirectory);
    app.add_option("--beside-title", arguments.beside_title, "its caption; default: its folder");
    if (const auto code = dlod::tools::parse_command_line(app, argc, argv)) return *code;
    if (arguments.metadata.empty())
        arguments.metadata = std::filesystem::path(arguments.capture).replace_extension(".json");
    try {
        std::filesystem::create_directories(arguments.out);
        draw_maps(arguments);
        if (!arguments.capture.empty()) draw_frame(arguments);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dlod-draw: %s\n", error.what());
        return 1;
    }
}
