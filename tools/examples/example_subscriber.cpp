// A planner's end of dlod: prints each pose, the share of moving pixels, and the moving objects ahead.
// usage: example_subscriber [LCM_URL [CHANNEL_PREFIX]]
#include <bit>
#include <cmath>
#include <cstdio>
#include <dlod/dynamic_mask_t.hpp>
#include <dlod/pose_t.hpp>
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
    while (lcm.handle() == 0) std::fflush(stdout);
    return 1;
}
