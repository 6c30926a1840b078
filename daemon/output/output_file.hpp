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
    /// Creates or truncates. @throws OutputError
    explicit OutputFile(std::filesystem::path path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// @throws OutputError
    void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
    void write(std::span<const std::byte> bytes);
    /// Hands everything to the system and closes. Without it the destructor does so, but cannot report a failure.
    /// @throws OutputError
    void close();

  private:
    void flush();
    void write_through(std::span<const std::byte> bytes);

    std::filesystem::path path_;
    int descriptor_;
    std::vector<std::byte> buffer_;
};

}  // namespace dlod::daemon
