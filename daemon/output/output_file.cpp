#include "daemon/output/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace dlod::daemon {
namespace {

constexpr std::size_t kBufferBytes = 64 * 1024;

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, int error) {
    throw OutputError(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(error)));
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path)
    : path_(std::move(path)), descriptor_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
    if (descriptor_ < 0) fail(path_, "create the file", errno);
    buffer_.reserve(kBufferBytes);
}

OutputFile::~OutputFile() {
    try {
        close();
    } catch (const OutputError&) {
        // Whoever must know of a failure calls close().
    }
}

void OutputFile::write(std::span<const std::byte> bytes) {
    if (buffer_.size() + bytes.size() > kBufferBytes) flush();
    if (bytes.size() > kBufferBytes) {
        write_through(bytes);
    } else {
        buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    }
}

void OutputFile::flush() {
    write_through(buffer_);
    buffer_.clear();
}

void OutputFile::write_through(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail(path_, "write", errno);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
}

void OutputFile::close() {
    if (descriptor_ < 0) return;
    struct Closer {
        int& descriptor;
        ~Closer() {
            if (descriptor >= 0) ::close(descriptor);
            descriptor = -1;
        }
    } closer{descriptor_};
    flush();
    // Network and quota file systems report a lack of space only here.
    const int descriptor = std::exchange(descriptor_, -1);
    if (::close(descriptor) != 0 && errno != EINTR) fail(path_, "close", errno);
}

}  // namespace dlod::daemon
