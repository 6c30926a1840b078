#include "tools/eval/evaluation.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace dlod::tools {
namespace {

using Json = nlohmann::ordered_json;

struct JsonVisitor {
    Json fields = Json::object();

    template <class T>
    void operator()(const char* name, const T& value) {
        fields[name] = value;
    }
    void operator()(const char* name, const std::optional<double>& value) {
        fields[name] = value ? Json(*value) : Json(nullptr);
    }
};

template <class Score>
Json fields_of(const Score& score) {
    JsonVisitor visitor;
    score.visit(visitor);
    return visitor.fields;
}

Json json_of(const Evaluation& evaluation) {
    Json json;
    json["trajectory"] = fields_of(evaluation.trajectory);
    if (evaluation.masks) json["masks"] = fields_of(*evaluation.masks);
    if (evaluation.tracks) json["tracks"] = fields_of(*evaluation.tracks);
    if (evaluation.tracks_far) json["tracks_far"] = fields_of(*evaluation.tracks_far);
    if (evaluation.map) json["map"] = fields_of(*evaluation.map);
    if (evaluation.tracks) {
        for (const MotionErrorRow& row : evaluation.tracks->motion_errors)
            json["motion_errors"].push_back(fields_of(row));
    }
    return json;
}

std::string text_of(const Json& value) {
    if (!value.is_number_float()) return value.dump();
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value.get<double>());
    return text;
}

}  // namespace

Evaluation evaluate(const Truth& truth, RunOutput run, const EvaluationOptions& options) {
    if (options.clock_step_s != 0.0) undo_clock_step(run, truth, options.clock_step_s);
    Evaluation evaluation;
    evaluation.trajectory = score_trajectory(truth, run.trajectory);
    if (!run.frames.empty()) {
        evaluation.trajectory.valid_pct =
            100.0 * static_cast<double>(run.trajectory.size()) / static_cast<double>(run.frames.size());
    }
    const Eigen::Isometry3d& T_true_run = evaluation.trajectory.T_true_run_by_rotation;
    if (std::filesystem::exists(run.folder / "labels.bin")) evaluation.masks = score_masks(truth, run, options.skip);
    if (run.has_tracks && !truth.objects.empty()) {
        evaluation.tracks = score_tracking(truth, run, T_true_run, options.range_m, options.skip);
        evaluation.tracks_far = score_tracking(truth, run, T_true_run, options.far_range_m, options.skip);
    }
    if (std::filesystem::exists(run.folder / "map.pcd") && std::filesystem::exists(truth.folder / "map_static.npy")) {
        evaluation.map = score_map(truth, run.folder / "map.pcd", T_true_run);
    }
    return evaluation;
}

std::string to_json(const Evaluation& evaluation) {
    return json_of(evaluation).dump(1) + "\n";
}

std::string to_text(const Evaluation& evaluation) {
    const Json json = json_of(evaluation);
    std::string text;
    const auto add_line = [&](const std::string& name, const Json& score) {
        text += name + ":";
        for (const auto& [field, value] : score.items()) text += "  " + field + "=" + text_of(value);
        text += "\n";
    };
    for (const auto& [name, score] : json.items()) {
        if (!score.is_array()) add_line(name, score);
        for (const Json& row : score.is_array() ? score : Json::array()) add_line(name, row);
    }
    return text;
}

}  // namespace dlod::tools
