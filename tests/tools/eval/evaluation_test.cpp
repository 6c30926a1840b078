#include "tools/eval/evaluation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/tools/eval/small_drive.hpp"

namespace dlod::tools::test {
namespace {

Evaluation evaluation_of(const SmallDrive& drive, EvaluationOptions options = {}) {
    drive.write();
    return evaluate(Truth(drive.truth_folder), RunOutput(drive.run_folder), options);
}

TEST(Evaluation, PerfectRunHasPerfectScores) {
    const SmallDrive drive;
    const Evaluation e = evaluation_of(drive);
    EXPECT_EQ(e.trajectory.poses, SmallDrive::kFrames);
    EXPECT_NEAR(e.trajectory.ate_m, 0.0, 1e-7);
    EXPECT_NEAR(e.trajectory.rpe1s_m.value(), 0.0, 1e-7);
    EXPECT_NEAR(e.trajectory.rpe1s_deg.value(), 0.0, 1e-5);
    EXPECT_NEAR(e.trajectory.drift_pct.value(), 0.0, 1e-5);
    ASSERT_TRUE(e.masks && e.tracks && e.map);
    EXPECT_EQ(e.masks->true_positives, 10 * 6);
    EXPECT_EQ(e.masks->false_positives, 0);
    EXPECT_EQ(e.masks->false_negatives, 0);
    EXPECT_DOUBLE_EQ(e.tracks->mota, 1.0);
    EXPECT_DOUBLE_EQ(e.tracks->idf1, 1.0);
    EXPECT_EQ(e.tracks->moving_objects, 2);
    EXPECT_EQ(e.tracks->object_frames, 20);
    EXPECT_EQ(e.tracks->delay_frames_median.value(), 0.0);
    EXPECT_NEAR(e.tracks->centre_error_m, 0.0, 1e-5);
    EXPECT_EQ(e.map->ghosts, 0);
    EXPECT_DOUBLE_EQ(e.map->kept_pct, 100.0);
}

TEST(Evaluation, AlternatingSidewaysErrorIsTheAte) {
    SmallDrive drive;
    // A cross pattern that no rigid transform can take up: +-5 cm in z, frame by frame.
    for (std::size_t k = 0; k < drive.run_poses.size(); ++k)
        drive.run_poses[k].translation().z() += k % 2 == 0 ? 0.05 : -0.05;
    const Evaluation e = evaluation_of(drive);
    EXPECT_NEAR(e.trajectory.ate_m, 0.05, 5e-4);
    // 1 s is 10 frames, an even number: the same error at both ends, none between them.
    EXPECT_NEAR(e.trajectory.rpe1s_m.value(), 0.0, 1e-6);
    ASSERT_EQ(e.trajectory.errors.size(), 20U);
    EXPECT_NEAR(e.trajectory.errors[3].position_m, 0.05, 5e-3);
}

TEST(Evaluation, ConstantTurnRateErrorIsTheRotationalRpe) {
    SmallDrive drive;
    for (std::size_t k = 0; k < drive.run_poses.size(); ++k) {
        const double angle_rad = static_cast<double>(k) * 0.2 * std::numbers::pi / 180.0;
        drive.run_poses[k].rotate(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()));
    }
    EXPECT_NEAR(evaluation_of(drive).trajectory.rpe1s_deg.value(), 2.0, 1e-4);
}

TEST(Evaluation, DriftIsTheErrorOfTheEndSeenFromTheFirstPose) {
    SmallDrive drive;
    drive.run_poses.back().translation().z() += 0.1;
    const Evaluation e = evaluation_of(drive);
    EXPECT_NEAR(e.trajectory.drift_pct.value(), 100.0 * 0.1 / e.trajectory.path_m, 1e-4);
}

TEST(Evaluation, TheWorstPoseIsSeenFromTheFirst) {
    SmallDrive drive;
    drive.run_poses[7].translation().z() += 0.3;
    drive.run_poses[12].rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()));
    const TrajectoryScore score = evaluation_of(drive).trajectory;
    EXPECT_NEAR(score.worst_m, 0.3, 1e-6);
    EXPECT_NEAR(score.worst_deg, 0.1 * 180.0 / std::numbers::pi, 1e-4);
    EXPECT_LT(score.ate_m, 0.1);
}

TEST(Evaluation, FramesWithoutAPoseAreCountedAndTimed) {
    const SmallDrive drive;
    drive.write();
    std::ifstream whole(drive.run_folder / "trajectory.tum");
    std::string kept;
    std::string line;
    for (int k = 0; std::getline(whole, line); ++k) kept += k >= 4 && k < 9 ? "" : line + "\n";
    std::ofstream(drive.run_folder / "trajectory.tum") << kept;
    const auto score = evaluate(Truth(drive.truth_folder), RunOutput(drive.run_folder), {}).trajectory;
    EXPECT_NEAR(score.valid_pct.value(), 75.0, 1e-9);
    EXPECT_NEAR(score.longest_gap_s, 0.6, 1e-6);
    EXPECT_NEAR(score.worst_m, 0.0, 1e-6);
}

TEST(Evaluation, AClockThatIsSetDuringTheDriveIsAllowedFor) {
    for (const double step_s : {-1.03, 2.03}) {
        const SmallDrive drive;
        drive.write();
        // From frame 8 on, pose and frame are stamped by the clock that was set.
        const auto shift = [&](const char* name, char separator, int column, double unit) {
            std::ifstream in(drive.run_folder / name);
            std::string all;
            std::string line;
            if (column > 0) {
                std::getline(in, line);
                all = line + "\n";
            }
            for (int k = 0; std::getline(in, line); ++k) {
                std::size_t begin = 0;
                for (int c = 0; c < column; ++c) begin = line.find(separator, begin) + 1;
                const std::size_t end = line.find(separator, begin);
                if (k >= 8) {
                    char stamp[40];
                    std::snprintf(
                        stamp, sizeof stamp, unit == 1.0 ? "%.9Lf" : "%.0Lf",
                        std::stold(line.substr(begin, end - begin)) + static_cast<long double>(unit * step_s));
                    line.replace(begin, end - begin, stamp);
                }
                all += line + "\n";
            }
            std::ofstream(drive.run_folder / name) << all;
        };
        shift("trajectory.tum", ' ', 0, 1.0);
        shift("frames.csv", ',', 2, 1e9);
        const Truth truth(drive.truth_folder);
        const Evaluation e = evaluate(truth, RunOutput(drive.run_folder), {.clock_step_s = step_s});
        EXPECT_EQ(e.trajectory.poses, SmallDrive::kFrames) << step_s;
        EXPECT_NEAR(e.trajectory.worst_m, 0.0, 1e-5) << step_s;
        EXPECT_NEAR(e.trajectory.longest_gap_s, 0.1, 1e-5) << step_s;
        EXPECT_EQ(e.masks->true_positives, 60) << step_s;
        const TrajectoryScore as_stamped = evaluate(truth, RunOutput(drive.run_folder), {}).trajectory;
        EXPECT_TRUE(as_stamped.poses < SmallDrive::kFrames || as_stamped.worst_m > 0.1) << step_s;
    }
}

TEST(Evaluation, RunOutsideOfTheDriveIsAnError) {
    const SmallDrive drive;
    drive.write();
    std::ofstream(drive.run_folder / "trajectory.tum") << "5.0 0 0 0 0 0 0 1\n";
    EXPECT_THROW(evaluate(Truth(drive.truth_folder), RunOutput(drive.run_folder), {}), std::runtime_error);
}

TEST(Evaluation, MaskErrorsAreCounted) {
    SmallDrive drive;
    drive.run_labels[12][0] = 1;   // a moving pixel missed
    drive.run_labels[13][8] = 2;   // a static one marked
    drive.run_labels[13][20] = 2;  // a ground one marked
    drive.labels[14][4] = 3;       // at rest, marked: counts for neither side
    drive.run_labels[5][8] = 2;    // in the start-up
    const MaskScore masks = evaluation_of(drive).masks.value();
    EXPECT_EQ(masks.true_positives, 58);
    EXPECT_EQ(masks.false_negatives, 1);
    EXPECT_EQ(masks.false_positives, 2);
    EXPECT_EQ(masks.at_rest, 1);
    EXPECT_EQ(masks.at_rest_marked, 1);
}

TEST(Evaluation, LabelsThatEndTooEarlyAreAnError) {
    SmallDrive drive;
    drive.run_labels.pop_back();
    EXPECT_THROW(evaluation_of(drive), std::runtime_error);
}

TEST(Evaluation, TrackErrorsAreCounted) {
    SmallDrive drive;
    for (std::size_t k = 15; k < 20; ++k) drive.run_tracks[k][0].id = 99;  // one switch
    drive.run_tracks[12].erase(drive.run_tracks[12].begin());              // one miss
    Track ghost = drive.run_tracks[11][0];
    ghost.id = 50;
    ghost.box.center_m.y() += 10.0;
    drive.run_tracks[11].push_back(ghost);  // one false track
    const TrackingScore tracks = evaluation_of(drive).tracks.value();
    EXPECT_EQ(tracks.id_switches, 1);
    EXPECT_DOUBLE_EQ(tracks.mota, 1.0 - 3.0 / 20.0);
    EXPECT_DOUBLE_EQ(tracks.recall, 19.0 / 20.0);
    EXPECT_DOUBLE_EQ(tracks.false_tracks_per_frame, 0.1);
    // Object 1 is with track 11 for four frames and with track 99 for five; object 2 with its own for ten.
    EXPECT_DOUBLE_EQ(tracks.idf1, 2.0 * (5 + 10) / (20 + 20));
}

TEST(Evaluation, DelayCountsFromTheFirstVisibleFrame) {
    SmallDrive drive;
    for (std::size_t k = 0; k < 4; ++k) drive.run_tracks[k][0].state = DynamicState::kUndefined;
    for (std::size_t k = 0; k < 20; ++k) drive.run_tracks[k][1].state = DynamicState::kUndefined;
    const TrackingScore tracks = evaluation_of(drive).tracks.value();
    EXPECT_EQ(tracks.never_found, 1);  // object 2: from frame 10 to the end
    EXPECT_DOUBLE_EQ(tracks.delay_frames_median.value(), (4 + 10) / 2.0);
}

TEST(Evaluation, TrackOnAnObjectAtRestIsNotFalse) {
    SmallDrive drive;
    for (auto& tracks : drive.run_tracks) tracks[1].state = DynamicState::kDynamic;  // before it moves, too
    EXPECT_DOUBLE_EQ(evaluation_of(drive, {.skip = 0}).tracks->false_tracks_per_frame, 0.0);
}

TEST(Evaluation, VelocityAndHeadingErrorsAreThoseOfMatchedTracks) {
    SmallDrive drive;
    for (auto& tracks : drive.run_tracks) {
        for (auto& track : tracks) track.velocity_mps *= 1.5;
    }
    const TrackingScore tracks = evaluation_of(drive, {.skip = 12}).tracks.value();
    EXPECT_NEAR(tracks.velocity_error_mps.value(), 0.5, 1e-3);
    EXPECT_NEAR(tracks.heading_error_deg.value(), 0.0, 0.1);
    const MotionErrorRow& all = tracks.motion_errors.back();
    EXPECT_GT(all.samples, 0);
    EXPECT_NEAR(all.velocity_median_mps.value(), 0.5, 1e-3);
    EXPECT_NEAR(all.speed_bias_mps.value(), 0.5, 1e-3);
    int samples = 0;
    for (const MotionErrorRow& row : tracks.motion_errors) samples += row.samples;
    EXPECT_EQ(samples, 2 * all.samples);  // each is in one band of speed, and in the whole
    EXPECT_FALSE(tracks.motion_errors.front().velocity_median_mps.has_value());  // nothing is slow
}

TEST(Evaluation, ArmsAndLegsThatSwingAreNoVelocity) {
    SmallDrive drive;
    // Boxes that stretch and shrink twice in five frames move their middles to and fro along the way.
    for (std::size_t k = 0; k < drive.objects.size(); ++k)
        drive.objects[k][0].center_m.x() += 0.08 * std::sin(0.8 * std::numbers::pi * static_cast<double>(k));
    const TrackingScore tracks = evaluation_of(drive).tracks.value();
    EXPECT_LT(tracks.velocity_error_mps.value(), 0.01);
}

TEST(Evaluation, GhostsAreMapPointsWhereOnlyMovingThingsWere) {
    SmallDrive drive;
    drive.map.emplace_back(2.0, 6.0, 0.95);   // beside a moving point
    drive.map.emplace_back(2.0, 6.0, 0.951);  // the same cell
    drive.map.emplace_back(3.0, 6.0, 3.0);    // far from everything: no ghost
    const MapScore map = evaluation_of(drive).map.value();
    EXPECT_EQ(map.ghosts, 1);
}

TEST(Evaluation, CoverageIsTheShareOfStaticPointsNearTheMap) {
    SmallDrive drive;
    std::erase_if(drive.map, [](const Eigen::Vector3d& p) { return p.x() > 4.9; });
    // Half of the floor is mapped, and half a metre beyond its edge.
    EXPECT_NEAR(evaluation_of(drive).map->kept_pct, 55.0, 3.0);
}

TEST(Evaluation, MissingColumnNamesFileAndColumn) {
    const SmallDrive drive;
    drive.write();
    std::ofstream(drive.run_folder / "frames.csv") << "seq,frame_id\n0,1\n";
    try {
        RunOutput run(drive.run_folder);
        FAIL() << "no error";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("frames.csv: no column stamp_ns"), std::string::npos) << error.what();
    }
}

TEST(Evaluation, JsonAndTextNameEveryScore) {
    const SmallDrive drive;
    const Evaluation e = evaluation_of(drive);
    EXPECT_NE(to_json(e).find("\"idf1\": 1.0"), std::string::npos);
    EXPECT_NE(to_text(e).find("masks:  iou=1  precision=1  recall=1  tp=60"), std::string::npos) << to_text(e);
}

}  // namespace
}  // namespace dlod::tools::test
