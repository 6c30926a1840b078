// What registrations are usually like.
#pragma once

#include "core/odometry/frame_registration.hpp"

namespace dlod {

/// How well the scans of late have fitted, and how one compares with that: a poor one may have been misled by its
/// prediction.
class UsualQuality {
  public:
    /// Far fewer matches than usual lie on their planes.
    bool lacks_matches(const MatchQuality& quality) const;
    /// Far less than usual speaks for the motion over the ground.
    bool lacks_fit(const MatchQuality& quality) const;
    /// Of two registrations of one scan the second is clearly better.
    /// @param judges_fit what speaks for the motion over the ground counts, too
    bool is_better(const MatchQuality& first, const MatchQuality& second, bool judges_fit) const;
    /// Another scan has been registered.
    void see(const MatchQuality& quality);

  private:
    MatchQuality usual_;
};

}  // namespace dlod
