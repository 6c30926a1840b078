// A file that is written once from front to back, where no failed write goes unnoticed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace dlod::daemon {

/// A result cannot be written; the message names the file and the system's reason.
class OutputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

class OutputFile {
  public:
    enum class Mode {
        kInPlace,
        /// What was there stays until close() has put the new file, complete and on the disk, in its place; without
        /// close() it stays for good.
        kReplace,
    };
    /// Of the name under which a file waits that will replace another.
    static constexpr const char* kPartSuffix = ".part";

    /// Creates or truncates. @throws OutputError
    explicit OutputFile(std::filesystem::path path, Mode mode = Mode::kInPlace);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// @throws OutputError
    void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
    void write(std::span<const std::byte> bytes);
    /// The same for an image that begins or ends with many zeros: they become a hole of the file, which reads as zeros
    /// and costs neither time nor space, where it can have any. @throws OutputError
    void write_sparse(std::span<const std::byte> bytes);
    /// Hands everything to the system and closes. Without it the destructor does so in place, but cannot report a
    /// failure.
    /// @throws OutputError
    void close();
    /// Of a file that replaces another, all of close() but the last step, which has next to nothing left to fail by:
    /// files that belong together are all finished before the first one is closed. @throws OutputError
    void finish();

  private:
    void flush();
    void write_through(std::span<const std::byte> bytes);
    void skip(std::span<const std::byte> zeros);
    void put_in_place();
    bool replaces() const { return path_ != target_; }

    std::filesystem::path target_;
    std::filesystem::path path_;  ///< what is written: the target, or a file beside it that will replace it
    int descriptor_;              ///< -1 once it is closed
    bool in_place_;
    std::vector<std::byte> buffer_;
};

}  // namespace dlod::daemon
