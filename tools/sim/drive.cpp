#include "tools/sim/drive.hpp"

#include <algorithm>
#include <future>
#include <memory>

namespace dlod::tools::sim {

void run_drive(const World& world, const Lidar& lidar, PacketStream& stream, int turns, int threads,
               const TurnSink& sink) {
    const StillGeometry geometry(world);
    // A turn knows all that happens in it, so turns are scanned side by side, each place with a caster of its own.
    struct Place {
        std::unique_ptr<RayCaster> caster;
        Scan scan;
        std::future<void> done;
    };
    std::vector<Place> places(static_cast<std::size_t>(std::clamp(threads, 1, turns)));
    const auto start = [&](Place& place, int turn) {
        if (place.caster == nullptr) place.caster = std::make_unique<RayCaster>(geometry);
        place.done =
            std::async(std::launch::async, [&lidar, &place, turn] { lidar.scan(turn, *place.caster, place.scan); });
    };
    const auto place_of = [&](int turn) -> Place& { return places[static_cast<std::size_t>(turn) % places.size()]; };
    const auto ahead = static_cast<int>(places.size());
    for (int turn = 0; turn < ahead; ++turn) start(place_of(turn), turn);
    Scan scan;
    for (int turn = 0; turn < turns; ++turn) {
        Place& place = place_of(turn);
        place.done.get();
        std::swap(scan, place.scan);
        if (turn + ahead < turns) start(place, turn + ahead);
        stream.push(scan);
        sink(scan, stream.records(), stream.take(turn + 1 == turns));
    }
}

}  // namespace dlod::tools::sim
