// A file of images of one size, one after the other.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace dlod::tools {

template <class T>
class ImageFile {
  public:
    /// Throws std::runtime_error naming the file when it cannot be read or holds no whole number of images.
    ImageFile(const std::filesystem::path& path, std::size_t values_per_image)
        : name_(path.string()), in_(path, std::ios::binary), image_(values_per_image) {
        if (!in_) throw std::runtime_error(name_ + ": cannot be read");
        const auto bytes = std::filesystem::file_size(path);
        const auto image_bytes = values_per_image * sizeof(T);
        if (image_bytes == 0 || bytes % image_bytes != 0) {
            throw std::runtime_error(name_ + ": not a whole number of images of " + std::to_string(values_per_image) +
                                     " values");
        }
        frames_ = bytes / image_bytes;
    }

    std::size_t frames() const { return frames_; }

    /// Image k; the reference is good until the next call.
    const std::vector<T>& read(std::size_t k) {
        const auto bytes = static_cast<std::streamsize>(image_.size() * sizeof(T));
        in_.seekg(static_cast<std::streamoff>(k) * bytes);
        in_.read(reinterpret_cast<char*>(image_.data()), bytes);
        if (!in_) throw std::runtime_error(name_ + ": image " + std::to_string(k) + " cannot be read");
        return image_;
    }

  private:
    std::string name_;
    std::ifstream in_;
    std::vector<T> image_;
    std::size_t frames_ = 0;
};

}  // namespace dlod::tools
