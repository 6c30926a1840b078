#include "driver/capture_rotation.hpp"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

namespace dlod::driver {
namespace {

constexpr const char* kExtension = ".pcap";
constexpr std::uint64_t kSmallestFile = 1 << 20;

/// A capture of the series, and its place in it.
struct Numbered {
    std::uint64_t number = 0;
    std::filesystem::path path;
};

/// PREFIX_NUMBER_TIME.pcap, oldest first.
std::vector<Numbered> list_captures(const std::filesystem::path& folder, const std::string& prefix) {
    std::vector<Numbered> all;
    std::error_code error;  // a disk that fails in between ends the list, not the program
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (!name.starts_with(prefix + "_") || entry->path().extension() != kExtension) continue;
        const char* const digits = name.data() + prefix.size() + 1;
        Numbered capture{0, entry->path()};
        const auto parsed = std::from_chars(digits, name.data() + name.size(), capture.number);
        if (parsed.ec == std::errc{} && *parsed.ptr == '_') all.push_back(std::move(capture));
    }
    std::sort(all.begin(), all.end(), [](const Numbered& a, const Numbered& b) {
        return std::pair(a.number, a.path) < std::pair(b.number, b.path);
    });
    return all;
}

/// With the metadata beside it.
void remove_capture(std::filesystem::path path) {
    std::error_code ignored;  // what cannot be removed is tried again with the next file
    std::filesystem::remove(path, ignored);
    std::filesystem::remove(path.replace_extension(".json"), ignored);
}

std::string utc(std::int64_t time_ns) {
    const std::time_t seconds = time_ns / 1'000'000'000;
    std::tm parts{};
    ::gmtime_r(&seconds, &parts);
    std::array<char, 32> text{};
    std::strftime(text.data(), text.size(), "%Y%m%dT%H%M%SZ", &parts);
    return text.data();
}

}  // namespace

CaptureRotation::CaptureRotation(RotationOptions options) : options_(std::move(options)) {
    options_.files = std::max(options_.files, 1);
    options_.file_bytes = std::max(options_.file_bytes, kSmallestFile);
}

bool CaptureRotation::fail(std::string error, std::int64_t time_ns) {
    error_ = std::move(error);
    last_ns_ = time_ns;
    const bool empty = writer_ != nullptr && writer_->size() == 0;
    writer_.reset();
    // While a disk stays full every attempt would leave a file without packets, in the place of one with.
    if (empty) remove_capture(file_);
    return false;
}

void CaptureRotation::remove_oldest(int keep) {
    auto captures = list_captures(options_.folder, options_.prefix);
    for (std::size_t i = 0; i + static_cast<std::size_t>(keep) < captures.size(); ++i) remove_capture(captures[i].path);
}

bool CaptureRotation::prepare() {
    std::error_code error;
    std::filesystem::create_directories(options_.folder, error);
    if (error) return fail(options_.folder.string() + ": cannot be created: " + error.message(), last_ns_);
    if (::access(options_.folder.c_str(), W_OK | X_OK) == 0) return true;
    return fail(options_.folder.string() + ": cannot be written: " + std::strerror(errno), last_ns_);
}

bool CaptureRotation::open(std::int64_t time_ns) {
    writer_.reset();
    last_ns_ = time_ns;
    if (!prepare()) return false;
    // Before the new one comes: the number holds at every moment.
    remove_oldest(options_.files - 1);
    const auto captures = list_captures(options_.folder, options_.prefix);
    const std::uint64_t number = captures.empty() ? 1 : captures.back().number + 1;
    std::array<char, 24> digits{};
    std::snprintf(digits.data(), digits.size(), "_%06llu_", static_cast<unsigned long long>(number));
    file_ = options_.folder / (options_.prefix + digits.data() + utc(time_ns) + kExtension);

    writer_ = std::make_unique<PcapWriter>(file_, options_.writer);
    if (!writer_->ok()) return fail(writer_->error(), time_ns);
    if (!options_.metadata.empty()) {
        auto beside = file_;
        std::ofstream json(beside.replace_extension(".json"), std::ios::binary | std::ios::trunc);
        json << options_.metadata;
        if (!json.flush()) {
            fail(beside.string() + ": cannot be written", time_ns);
            remove_capture(file_);
            return false;
        }
    }
    ++opened_;
    return true;
}

bool CaptureRotation::write(const Packet& packet) {
    const std::int64_t now_ns = packet.receive_ns;
    if (!error_.empty() && now_ns >= last_ns_ && now_ns - last_ns_ < options_.retry_ns) return false;
    // Headers of the packet or its fragments come on top: an upper bound is good enough for a limit.
    const std::uint64_t bytes = packet.data.size() + packet.data.size() / 8 + 128;
    const bool full = writer_ != nullptr && writer_->size() + bytes > options_.file_bytes;
    if (full && !flush()) return false;
    if ((writer_ == nullptr || full) && !open(now_ns)) return false;
    if (!writer_->write(packet)) {
        if (!writer_->ok()) return fail(writer_->error(), now_ns);
        return false;
    }
    // After a failure it goes on once a packet is on the disk, not when it is in memory.
    if (!error_.empty() && !flush()) return false;
    last_ns_ = now_ns;
    error_.clear();
    return true;
}

bool CaptureRotation::flush() {
    if (writer_ == nullptr) return error_.empty();
    return writer_->flush() || fail(writer_->error(), last_ns_);
}

}  // namespace dlod::driver
