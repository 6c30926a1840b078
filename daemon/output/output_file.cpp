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
constexpr std::size_t kPageBytes = 4096;  // what a hole is made of

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, int error) {
    throw OutputError(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(error)));
}

bool is_zero(std::span<const std::byte> bytes) {
    return bytes.empty() ||
           (bytes.front() == std::byte{0} && std::memcmp(bytes.data(), bytes.data() + 1, bytes.size() - 1) == 0);
}

std::filesystem::path path_to_write(const std::filesystem::path& target, OutputFile::Mode mode) {
    return mode == OutputFile::Mode::kInPlace ? target
                                              : std::filesystem::path(target.string() + OutputFile::kPartSuffix);
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

void OutputFile::write_sparse(std::span<const std::byte> bytes) {
    flush();
    std::size_t begin = 0;
    while (begin + kPageBytes < bytes.size() && is_zero(bytes.subspan(begin, kPageBytes))) begin += kPageBytes;
    // The last page is written, whatever is in it: it gives the file its length.
    const std::size_t last = bytes.empty() ? 0 : (bytes.size() - 1) / kPageBytes * kPageBytes;
    std::size_t end = last;
    while (end > begin && is_zero(bytes.subspan(end - kPageBytes, kPageBytes))) end -= kPageBytes;
    skip(bytes.first(begin));
    write_through(bytes.subspan(begin, end - begin));
    skip(bytes.subspan(end, last - end));
    write_through(bytes.subspan(last));
}

void OutputFile::skip(std::span<const std::byte> zeros) {
    if (zeros.empty() || ::lseek(descriptor_, static_cast<off_t>(zeros.size()), SEEK_CUR) >= 0) return;
    write_through(zeros);
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
