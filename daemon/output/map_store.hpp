// Maps that are kept: on command, and at the end of a run.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/map/cell_table.hpp"
#include "core/types/parameter.hpp"

namespace dlod::daemon {

struct MapStoreConfig {
    std::string folder;
    int most = 100;
    bool at_stop = false;

    template <class V>
    void visit(V& v) {
        v.text("folder", folder,
               "where maps are saved on command, as PCD and PLY; empty: in the folder maps of the service's state "
               "directory, outside of a service nowhere");
        v.parameter("most", most, Range{1, 100'000}, "maps",
                    "a folder with so many takes no further one: commands cannot fill the disk");
        v.flag("at_stop", at_stop,
               "save the map as last.pcd and last.ply at a clean stop; a map of millions of points takes seconds, "
               "which the unit's TimeoutStopSec must allow");
    }
};

/// True for what may be the name of a map: 1 to 64 letters, digits, '_', '-' and '.', no '.' first. So no name leads
/// out of the folder.
bool is_map_name(std::string_view name);

/// Keeps maps in one folder, NAME.pcd and NAME.ply each. Two files cannot be replaced at one instant: where the program
/// is killed between the two, the next one puts the second in place. Until then a reader can tell by the checksum of
/// the points, a comment "map 0123456789abcdef" in the header of either file. Several programs may have one folder. For
/// one thread.
class MapStore {
  public:
    /// Completes or removes what a kill has left undone; so does every save.
    /// @param config its folder, or where that is empty and the service has a state directory, a folder in that
    explicit MapStore(const MapStoreConfig& config);

    struct Result {
        bool ok = false;
        std::string text;  ///< what was saved, or why nothing was
    };
    /// Puts the points in order and writes them; a map of that name is replaced at once as a whole or, where anything
    /// fails, not at all; nor by a map without points. @param name empty: the time
    Result save(std::string name, std::vector<CellTable::Entry> points) const;

  private:
    bool is_full(const std::string& name) const;
    void tidy_up() const;

    std::filesystem::path folder_;
    int most_;
};

}  // namespace dlod::daemon
