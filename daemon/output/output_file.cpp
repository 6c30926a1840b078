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

std::filesystem::path path_to_write(const std::filesystem::path& target, OutputFile::Mode mode) {
    return mode == OutputFile::Mode::kInPlace ? target : std::filesystem::path(target.string() + ".part");
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path, Mode mode)
    : target_(std::move(path)),
      path_(path_to_write(target_, mode)),
      descriptor_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)),
      in_place_(mode == Mode::kInPlace) {
    if (descriptor_ < 0) fail(path_, "create the file", errno);
    buffer_.reserve(kBufferBytes);
}

OutputFile::~OutputFile() {
    if (replaces()) {
        if (descriptor_ >= 0) ::close(descriptor_);
        if (!in_place_) ::unlink(path_.c_str());
        return;
    }
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
    finish();
    if (!in_place_) put_in_place();
}

void OutputFile::finish() {
    if (descriptor_ < 0) return;
    struct Closer {
        int& descriptor;
        ~Closer() {
            if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
        }
    } closer{descriptor_};
    flush();
    if (replaces() && ::fsync(descriptor_) != 0) fail(path_, "write to the disk", errno);
    // Network and quota file systems report a lack of space only here.
    const int descriptor = std::exchange(descriptor_, -1);
    if (::close(descriptor) != 0 && errno != EINTR) fail(path_, "close", errno);
    if (replaces() && std::filesystem::is_directory(target_)) fail(target_, "replace the file", EISDIR);
}

void OutputFile::put_in_place() {
    if (::rename(path_.c_str(), target_.c_str()) != 0) fail(target_, "replace the file", errno);
    in_place_ = true;
    // The new name, too, is to outlive a loss of power. Where the folder cannot be opened the system sees to it in
    // time.
    const int folder = ::open(target_.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;
    ::fsync(folder);
    ::close(folder);
}

}  // namespace dlod::daemon
