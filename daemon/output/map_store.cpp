#include "daemon/output/map_store.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <span>
#include <system_error>
#include <utility>

#include "daemon/output/point_cloud_file.hpp"

namespace dlod::daemon {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr std::string_view kChecksum = "map ";
constexpr std::size_t kHeaderBytes = 200;  // the checksum is among them

bool is_name_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
           c == '.';
}

std::filesystem::path folder_of(const MapStoreConfig& config) {
    if (!config.folder.empty()) return config.folder;
    // systemd names the state directory.
    const char* state = std::getenv("STATE_DIRECTORY");
    return state == nullptr ? std::filesystem::path() : std::filesystem::path(state) / "maps";
}

std::string name_by_time() {
    return fmt::format("map_{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr)));
}

/// FNV-1a, 64 bits, of the points as they are written.
std::string checksum_comment(std::span<const MapPoint> points) {
    std::uint64_t hash = 0xcbf29ce484222325U;
    for (const std::byte byte : std::as_bytes(points)) {
        hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3U;
    }
    return fmt::format("{}{:016x}", kChecksum, hash);
}

/// The checksum comment in the header of a saved file; empty where there is none.
std::string checksum_in(const std::filesystem::path& path) {
    std::string header(kHeaderBytes, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(header.data(), static_cast<std::streamsize>(header.size()));
    header.resize(static_cast<std::size_t>(file.gcount()));
    const auto at = header.find(kChecksum);
    return at == std::string::npos ? "" : header.substr(at, kChecksum.size() + 16);
}

}  // namespace

bool is_map_name(std::string_view name) {
    return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
           std::all_of(name.begin(), name.end(), is_name_character);
}

MapStore::MapStore(const MapStoreConfig& config) : folder_(folder_of(config)), most_(config.most) {
    complete_pairs();
}

/// Where a PCD has been replaced, and the PLY of the same points waits beside the old one, the kill came in between.
void MapStore::complete_pairs() const {
    // A folder that cannot be used is named when a map is to be saved.
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder_, error), end; !error && entry != end;
         entry.increment(error)) {
        auto ply = entry->path();
        if (ply.extension() != OutputFile::kPartSuffix || ply.replace_extension().extension() != ".ply") continue;
        auto pcd = ply;
        pcd.replace_extension(".pcd");
        const std::string waiting = checksum_in(entry->path());
        std::error_code failure;
        if (!waiting.empty() && waiting == checksum_in(pcd)) std::filesystem::rename(entry->path(), ply, failure);
    }
}

bool MapStore::is_full(const std::string& name) const {
    if (std::filesystem::exists(folder_ / (name + ".pcd"))) return false;
    const auto maps = std::count_if(std::filesystem::directory_iterator(folder_), {},
                                    [](const auto& entry) { return entry.path().extension() == ".pcd"; });
    return maps >= most_;
}

MapStore::Result MapStore::save(std::string name, std::vector<CellTable::Entry> points) const {
    if (folder_.empty()) return {false, "no folder for maps: set saved_maps.folder"};
    if (name.empty()) name = name_by_time();
    if (!is_map_name(name)) {
        return {false, fmt::format("not a name for a map: 1 to {} letters, digits, '_', '-' and '.', no '.' first",
                                   kLongestName)};
    }
    if (points.empty()) return {false, "the map has no points yet"};
    const auto path = folder_ / name;
    try {
        std::filesystem::create_directories(folder_);
        if (is_full(name)) {
            return {false, fmt::format("{}: holds {} maps already: remove some, or raise saved_maps.most",
                                       folder_.string(), most_)};
        }
        const auto map = CellTable::sorted(std::move(points));
        OutputFile pcd(path.string() + ".pcd", OutputFile::Mode::kReplace);
        OutputFile ply(path.string() + ".ply", OutputFile::Mode::kReplace);
        const std::string comment = checksum_comment(map);
        write_pcd(pcd, map, comment);
        write_ply(ply, map, comment);
        // What can fail has not failed before either is replaced: they stay a pair. The PCD goes first: complete_pairs.
        pcd.finish();
        ply.finish();
        pcd.close();
        ply.close();
        return {true, fmt::format("{}.pcd and .ply: {} points", path.string(), map.size())};
    } catch (const OutputError& error) {
        return {false, error.what()};
    } catch (const std::filesystem::filesystem_error& error) {
        return {false, fmt::format("{}: cannot be used for maps: {}", folder_.string(), error.code().message())};
    }
}

}  // namespace dlod::daemon
