#include "daemon/sensor/metadata_cache.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

#include "daemon/output/output_file.hpp"

namespace dlod::daemon {

MetadataCache::MetadataCache(const std::filesystem::path& state_directory, const std::string& host) {
    std::string name = host;
    // A host name may hold anything that the configuration does: none of it may leave the directory.
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-'; }, '_');
    path_ = state_directory / ("metadata-" + name + ".json");
}

std::optional<std::string> MetadataCache::load() const {
    std::ifstream file(path_, std::ios::binary);
    if (!file) return std::nullopt;
    std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (file.bad() || text.empty()) return std::nullopt;
    return text;
}

std::optional<std::string> MetadataCache::store(const std::string& metadata) const {
    try {
        OutputFile file(path_, OutputFile::Mode::kReplace);
        file.write(metadata);
        file.close();
    } catch (const OutputError& error) {
        return error.what();
    }
    return std::nullopt;
}

}  // namespace dlod::daemon
