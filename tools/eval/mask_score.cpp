#include "tools/eval/mask_score.hpp"

#include <stdexcept>

#include "tools/eval/image_file.hpp"

namespace dlod::tools {

std::vector<int> answering_rows(const Truth& truth, const RunOutput& run) {
    std::vector<int> rows(truth.frames(), -1);
    for (std::size_t row = 0; row < run.frames.size(); ++row) {
        if (const auto frame = truth.frame_at(run.frames[row].stamp_s())) rows[*frame] = static_cast<int>(row);
    }
    return rows;
}

MaskScore score_masks(const Truth& truth, const RunOutput& run, int skip) {
    const std::size_t frames = truth.frames();
    const auto truth_file = truth.folder / "labels.bin";
    const std::size_t pixels = std::filesystem::file_size(truth_file) / frames;
    ImageFile<std::uint8_t> truth_labels(truth_file, pixels);
    ImageFile<std::uint8_t> near(truth.folder / "near.bin", pixels / 8);
    ImageFile<std::uint8_t> run_labels(run.folder / "labels.bin", pixels);
    if (run_labels.frames() < run.frames.size()) {
        throw std::runtime_error((run.folder / "labels.bin").string() + ": " + std::to_string(run_labels.frames()) +
                                 " frames, but frames.csv lists " + std::to_string(run.frames.size()));
    }
    const std::vector<int> rows = answering_rows(truth, run);

    MaskScore score;
    for (auto j = static_cast<std::size_t>(skip); j < frames; ++j) {
        ++score.frames;
        const auto& label = truth_labels.read(j);
        const auto& is_near = near.read(j);
        const auto* predicted = rows[j] >= 0 ? run_labels.read(static_cast<std::size_t>(rows[j])).data() : nullptr;
        for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
            if ((is_near[pixel / 8] >> (7 - pixel % 8) & 1) == 0) continue;
            const bool marked =
                predicted != nullptr && static_cast<PixelLabel>(predicted[pixel]) == PixelLabel::kDynamic;
            switch (static_cast<TruthLabel>(label[pixel])) {
                case TruthLabel::kNoReturn:
                    break;
                case TruthLabel::kMoving:
                    ++(marked ? score.true_positives : score.false_negatives);
                    break;
                case TruthLabel::kAtRest:
                    ++score.at_rest;
                    score.at_rest_marked += marked ? 1 : 0;
                    break;
                case TruthLabel::kStatic:
                case TruthLabel::kGround:
                    score.false_positives += marked ? 1 : 0;
                    break;
            }
        }
    }
    return score;
}

}  // namespace dlod::tools
