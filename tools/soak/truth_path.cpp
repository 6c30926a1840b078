#include "tools/soak/truth_path.hpp"

#include <cmath>
#include <fstream>
#include <stdexcept>

namespace dlod::tools::soak {

TruthPath::TruthPath(const std::filesystem::path& file, std::int64_t turn_ns)
    : turn_us_(1e-3 * static_cast<double>(turn_ns)) {
    std::ifstream stream(file);
    long double stamp_s = 0.0L;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    while (stream >> stamp_s >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()) {
        if (poses_.empty()) first_us_ = static_cast<std::int64_t>(std::llround(1e6L * stamp_s));
        poses_.push_back(Eigen::Translation3d(t) * q.normalized());
    }
    if (poses_.size() < 2) throw std::runtime_error(file.string() + ": no poses");
}

Eigen::Isometry3d TruthPath::at(std::int64_t stamp_us) const {
    const double turns = static_cast<double>(stamp_us - first_us_) / turn_us_;
    const double whole = std::floor(turns);
    const double share = turns - whole;
    const auto n = static_cast<std::int64_t>(poses_.size());
    const auto index = ((static_cast<std::int64_t>(whole) % n) + n) % n;
    const Eigen::Isometry3d& a = poses_[static_cast<std::size_t>(index)];
    const Eigen::Isometry3d& b = poses_[static_cast<std::size_t>((index + 1) % n)];
    const Eigen::Quaterniond q = Eigen::Quaterniond(a.linear()).slerp(share, Eigen::Quaterniond(b.linear()));
    const Eigen::Vector3d t = (1.0 - share) * a.translation() + share * b.translation();
    return Eigen::Translation3d(t) * q;
}

}  // namespace dlod::tools::soak
