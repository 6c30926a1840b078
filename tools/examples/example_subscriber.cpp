// A planner's end of dlod: prints each pose, the share of moving pixels, the moving objects, the nearest obstacle, the
// sensor, and what is wrong.
// usage: example_subscriber [LCM_URL [CHANNEL_PREFIX]]
#include <bit>
#include <cmath>
#include <cstdio>
#include <dlod/dynamic_mask_t.hpp>
#include <dlod/obstacles_t.hpp>
#include <dlod/pose_t.hpp>
#include <dlod/sensor_t.hpp>
#include <dlod/status_t.hpp>
#include <dlod/tracks_t.hpp>
#include <lcm/lcm-cpp.hpp>
#include <string>

namespace {

class Planner {
  public:
    void on_pose(const lcm::ReceiveBuffer*, const std::string&, const dlod::pose_t* pose) {
        if ((pose->flags & dlod::pose_t::VALID) == 0) {
            std::printf("%ld no valid pose, flags %d\n", static_cast<long>(pose->sequence), pose->flags);
            return;
        }
        if ((pose->flags & dlod::pose_t::RESTARTED) != 0) {
            std::printf("odom begins anew: what was remembered in it means nothing any more\n");
        }
        pose_ = *pose;
        std::printf("%ld at %.2f %.2f %.2f m, %.2f m/s\n", static_cast<long>(pose->sequence), pose->position[0],
                    pose->position[1], pose->position[2],
                    std::hypot(pose->linear_velocity[0], pose->linear_velocity[1]));
    }

    void on_mask(const lcm::ReceiveBuffer*, const std::string&, const dlod::dynamic_mask_t* mask) {
        int pixels = 0;
        for (const auto byte : mask->dynamic) pixels += std::popcount(static_cast<unsigned char>(byte));
        std::printf("%ld %d of %d pixels move\n", static_cast<long>(mask->sequence), pixels, mask->rows * mask->width);
    }

    /// Whether the pixel (row, column) of the range image belongs to a moving object.
    static bool is_dynamic(const dlod::dynamic_mask_t& mask, int row, int column) {
        const int i = (row - mask.first_row) * mask.width + column;
        return (mask.dynamic[static_cast<std::size_t>(i / 8)] >> (7 - i % 8) & 1) != 0;
    }

    void on_tracks(const lcm::ReceiveBuffer*, const std::string&, const dlod::tracks_t* tracks) {
        for (const auto& track : tracks->tracks) {
            if (track.state != dlod::track_t::DYNAMIC) continue;
            const double dx = track.position[0] - pose_.position[0];
            const double dy = track.position[1] - pose_.position[1];
            std::printf("  object %ld, %.1f m away, moves at %.1f m/s, %.1f x %.1f x %.1f m\n",
                        static_cast<long>(track.id), std::hypot(dx, dy),
                        std::hypot(track.velocity[0], track.velocity[1]), track.size[0], track.size[1], track.size[2]);
        }
    }

    /// Only where lcm.obstacles.every_frames is set.
    void on_obstacles(const lcm::ReceiveBuffer*, const std::string&, const dlod::obstacles_t* obstacles) {
        if (obstacles->count == 0) return;
        // The nearest comes first; a point in odom is origin + unit * (x, y, z).
        const double x = obstacles->unit * obstacles->x[0];
        const double y = obstacles->unit * obstacles->y[0];
        std::printf("  %d obstacles within %.1f m, the nearest %.2f m away%s\n", obstacles->count, obstacles->radius,
                    std::hypot(x, y), (obstacles->flags[0] & dlod::obstacles_t::DYNAMIC) != 0 ? ", moving" : "");
    }

    void on_sensor(const lcm::ReceiveBuffer*, const std::string&, const dlod::sensor_t* sensor) {
        std::printf("sensor %s %s, %d x %d pixels, %.0f Hz\n", sensor->product_line.c_str(),
                    sensor->serial_number.c_str(), sensor->rows, sensor->columns, sensor->frame_rate);
    }

    void on_status(const lcm::ReceiveBuffer*, const std::string&, const dlod::status_t* status) {
        if (status->health != dlod::status_t::OK) std::printf("dlod says: %s\n", status->health_text.c_str());
    }

  private:
    dlod::pose_t pose_{};
};

}  // namespace

int main(int argc, char** argv) {
    lcm::LCM lcm(argc > 1 ? argv[1] : "");
    if (!lcm.good()) {
        std::fprintf(stderr, "LCM cannot be opened: is there a route for multicast?\n");
        return 1;
    }
    const std::string prefix = argc > 2 ? argv[2] : "DLOD_";
    Planner planner;
    lcm.subscribe(prefix + "POSE", &Planner::on_pose, &planner);
    lcm.subscribe(prefix + "MASK", &Planner::on_mask, &planner);
    lcm.subscribe(prefix + "TRACKS", &Planner::on_tracks, &planner);
    lcm.subscribe(prefix + "OBSTACLES", &Planner::on_obstacles, &planner);
    lcm.subscribe(prefix + "SENSOR", &Planner::on_sensor, &planner);
    lcm.subscribe(prefix + "STATUS", &Planner::on_status, &planner);
    while (lcm.handle() == 0) std::fflush(stdout);
    return 1;
}
