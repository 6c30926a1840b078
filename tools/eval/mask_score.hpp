// How well the pixels labelled dynamic are those of moving objects.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/eval/run_output.hpp"
#include "tools/eval/truth.hpp"

namespace dlod::tools {

/// Row of frames.csv that answers each frame of the truth, -1 where none does.
std::vector<int> answering_rows(const Truth& truth, const RunOutput& run);

/// Over pixels with a return within 25 m (near.bin). A moving object's pixels are positive; those of one that rests now
/// and moves at another time count for neither side; all others are negative.
struct MaskScore {
    std::int64_t true_positives = 0;
    std::int64_t false_positives = 0;
    std::int64_t false_negatives = 0;
    std::int64_t at_rest = 0;         ///< pixels of objects at rest
    std::int64_t at_rest_marked = 0;  ///< of these, those labelled dynamic
    int frames = 0;                   ///< scored, start-up left out

    template <class V>
    void visit(V& v) const {
        v("iou", ratio(true_positives, true_positives + false_positives + false_negatives));
        v("precision", ratio(true_positives, true_positives + false_positives));
        v("recall", ratio(true_positives, true_positives + false_negatives));
        v("tp", true_positives);
        v("fp", false_positives);
        v("fn", false_negatives);
        v("fp_per_frame", ratio(false_positives, frames));
        v("still_marked", ratio(at_rest_marked, at_rest));
    }

    static double ratio(std::int64_t part, std::int64_t whole) {
        return static_cast<double>(part) / static_cast<double>(whole > 1 ? whole : 1);
    }
};

/// Every frame of the truth from `skip` on counts; one that the run did not answer is all missed. Throws
/// std::runtime_error naming the file whose size does not fit.
MaskScore score_masks(const Truth& truth, const RunOutput& run, int skip);

}  // namespace dlod::tools
