// Tunables of the recording.
#pragma once

#include <string>

#include "core/types/parameter.hpp"

namespace dlod::daemon {

struct RecordingConfig {
    std::string folder;
    int file_megabytes = 1000;
    int files = 10;
    int buffer_megabytes = 32;

    friend bool operator==(const RecordingConfig&, const RecordingConfig&) = default;

    template <class V>
    void visit(V& v) {
        v.text("folder", folder,
               "where received packets are recorded as captures (pcap) that can be replayed; a relative path of a "
               "service is in its state directory, any other place its unit must allow (ReadWritePaths=); empty: "
               "nowhere");
        v.parameter("file_megabytes", file_megabytes, Range{1, 1'000'000}, "MB", "size at which a new file is begun");
        v.parameter("files", files, Range{1, 100'000}, "files", "files kept at most; the oldest is removed");
        v.parameter("buffer_megabytes", buffer_megabytes, Range{1, 4096}, "MB",
                    "packets that may wait for a slow disk; beyond, packets are left out of the recording, never out "
                    "of the odometry");
    }
};

}  // namespace dlod::daemon
