// dlod-eval: scores a replay's output folder against a drive's truth.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tools/eval/evaluation.hpp"

int main(int argc, char** argv) {
    CLI::App app{"Scores the output folder of `dlod replay` against a drive's truth: trajectory, masks, tracks, map."};
    std::string truth_folder;
    std::string run_folder;
    dlod::tools::EvaluationOptions options;
    bool json = false;
    app.add_option("TRUTH", truth_folder, "truth folder of the drive")->required()->check(CLI::ExistingDirectory);
    app.add_option("OUT", run_folder, "output folder of the replay")->required()->check(CLI::ExistingDirectory);
    app.add_option("--range", options.range_m, "of tracks, metres; masks are scored within the range of near.bin, 25 m")
        ->capture_default_str();
    app.add_option("--skip", options.skip, "frames of start-up left out of mask and track scores")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_flag("--json", json, "JSON instead of text");
    CLI11_PARSE(app, argc, argv);
    try {
        const dlod::tools::Truth truth(truth_folder);
        const auto evaluation = evaluate(truth, dlod::tools::RunOutput(run_folder), options);
        std::fputs((json ? to_json(evaluation) : to_text(evaluation)).c_str(), stdout);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dlod-eval: %s\n", error.what());
        return 1;
    }
}
