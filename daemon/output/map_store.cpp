#include "daemon/output/map_store.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
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

/// NAME.pcd.part or NAME.ply.part: what is being saved, or was.
bool is_part_of_map(std::filesystem::path path) {
    if (path.extension() != OutputFile::kPartSuffix) return false;
    path = path.stem();
    return (path.extension() == ".pcd" || path.extension() == ".ply") && is_map_name(path.stem().string());
}

/// Tells programs that save into a folder (LOCK_SH) from one that tidies it up (LOCK_EX). A kill lets go of it.
class FolderLock {
  public:
    FolderLock(const std::filesystem::path& folder, int operation)
        : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)),
          refused_(descriptor_ >= 0 && ::flock(descriptor_, operation) != 0 && errno == EWOULDBLOCK) {}
    ~FolderLock() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;

    /// Another program has it. Where the file system knows no locks, nobody is taken to be there.
    bool is_refused() const { return refused_; }

  private:
    int descriptor_;
    bool refused_;
};

}  // namespace

bool is_map_name(std::string_view name) {
    return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
           std::all_of(name.begin(), name.end(), is_name_character);
}

MapStore::MapStore(const MapStoreConfig& config) : folder_(folder_of(config)), most_(config.most) {
    tidy_up();
}

/// Where a PCD has been replaced, and the PLY of the same points waits beside the old one, the kill came in between.
/// What else waits will never be complete.
void MapStore::tidy_up() const {
    const FolderLock lock(folder_, LOCK_EX | LOCK_NB);
    if (lock.is_refused()) return;  // somebody is saving
    // A folder that cannot be used is named when a map is to be saved.
    std::error_code error;
    std::vector<std::filesystem::path> left_behind;
    for (std::filesystem::directory_iterator entry(folder_, error), end; !error && entry != end;
         entry.increment(error)) {
        if (is_part_of_map(entry->path())) left_behind.push_back(entry->path());
    }
    for (const auto& part : left_behind) {
        auto target = part;
        target.replace_extension();
        auto pcd = target;
        pcd.replace_extension(".pcd");
        const std::string waiting = target.extension() == ".ply" ? checksum_in(part) : "";
        std::error_code failure;
        if (!waiting.empty() && waiting == checksum_in(pcd)) {
            std::filesystem::rename(part, target, failure);
        } else {
            std::filesystem::remove(part, failure);
        }
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
        tidy_up();
        const FolderLock lock(folder_, LOCK_SH);
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
        // What can fail has not failed before either is replaced: they stay a pair. The PCD goes first: tidy_up.
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
