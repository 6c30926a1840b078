#include "core/odometry/odometry.hpp"

namespace dlod {

struct Odometry::State {};

Odometry::Odometry(const SensorModel&, const OdometryConfig&) : state_(std::make_unique<State>()) {}
Odometry::~Odometry() = default;

void Odometry::process(Frame& frame, const OdometryFeedback*) { frame.odometry.valid = false; }

}  // namespace dlod
