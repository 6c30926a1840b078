// dlod-eval: scores a replay's output folder against a drive's truth.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <vector>

#include "tools/command_line.hpp"
#include "tools/eval/evaluation.hpp"

namespace {

/// A table of the pose errors over the frames, for plots.
void write_errors(const std::string& file, const std::vector<dlod::tools::PoseError>& errors) {
    std::unique_ptr<FILE, int (*)(FILE*)> out(std::fopen(file.c_str(), "w"), std::fclose);
    if (!out) throw std::runtime_error(file + ": cannot be written");
    std::fputs("time_s,position_error_m,rotation_error_deg\n", out.get());
    for (const auto& error : errors) {
        std::fprintf(out.get(), "%.3f,%.6f,%.6f\n", error.stamp_s - errors.front().stamp_s, error.position_m,
                     error.rotation_deg);
    }
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Scores the output folder of `dlod replay` against a drive's truth: trajectory, masks, tracks, map."};
    std::string truth_folder;
    std::string run_folder;
    dlod::tools::EvaluationOptions options;
    std::string errors_file;
    bool json = false;
    app.add_option("TRUTH_DIR", truth_folder, "truth folder of the drive")->required()->check(CLI::ExistingDirectory);
    app.add_option("RUN_DIR", run_folder, "output folder of the replay")->required()->check(CLI::ExistingDirectory);
    app.add_option("--range", options.range_m, "of tracks, metres; masks are scored within the range of near.bin, 25 m")
        ->capture_default_str();
    app.add_option("--far-range", options.far_range_m, "of tracks, scored once more, metres")->capture_default_str();
    app.add_option("--skip", options.skip, "frames of start-up left out of mask and track scores")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--clock-step", options.clock_step_s,
                   "seconds by which the sensor's clock was set during the drive (dlod-sim --clock-step)");
    app.add_option("--errors", errors_file, "also write the pose errors over time to this CSV file");
    app.add_flag("--json", json, "JSON instead of text");
    if (const auto code = dlod::tools::parse_command_line(app, argc, argv)) return *code;
    try {
        const dlod::tools::Truth truth(truth_folder);
        const auto evaluation = evaluate(truth, dlod::tools::RunOutput(run_folder), options);
        if (!errors_file.empty()) write_errors(errors_file, evaluation.trajectory.errors);
        std::fputs((json ? to_json(evaluation) : to_text(evaluation)).c_str(), stdout);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dlod-eval: %s\n", error.what());
        return 1;
    }
}
