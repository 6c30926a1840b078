// A disk that is full soon.
#pragma once

#include <stdlib.h>
#include <sys/mount.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/namespaces.hpp"

namespace dlod::test {

/// A folder on a file system of its own, seen by this process and those that it starts. Ask usable() first: not every
/// system lets this process mount one.
class SmallDisk {
  public:
    explicit SmallDisk(std::size_t bytes) {
        std::string name = (std::filesystem::temp_directory_path() / "dlod_disk_XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) return;
        path_ = name;
        const std::string size = "size=" + std::to_string(bytes);
        // Mounts of this process's own.
        usable_ = enter_namespaces(CLONE_NEWNS) && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                  ::mount("dlod-test", path_.c_str(), "tmpfs", 0, size.c_str()) == 0;
    }
    ~SmallDisk() {
        if (usable_) ::umount2(path_.c_str(), MNT_DETACH);
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

    bool usable() const { return usable_; }
    const std::filesystem::path& path() const { return path_; }

    /// Takes what is free but so many bytes.
    void fill(std::size_t bytes_left = 0) const {
        const auto free = std::filesystem::space(path_).available;
        std::ofstream file(path_ / kFiller, std::ios::binary | std::ios::app);
        for (std::size_t i = bytes_left; i < free; i += kBlock) file.write(std::string(kBlock, 'x').data(), kBlock);
    }
    void clear() const { std::filesystem::remove(path_ / kFiller); }

  private:
    static constexpr const char* kFiller = "filler";
    static constexpr std::size_t kBlock = 4096;

    std::filesystem::path path_;
    bool usable_ = false;
};

}  // namespace dlod::test
