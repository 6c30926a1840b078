#include "tools/sim/lidar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/types/track.hpp"

namespace dlod::tools::sim {
namespace {

/// Shares of a beam that its rays stand for: the middle, the rim.
constexpr std::array kShare{0.4, 0.2, 0.2, 0.2};

/// Surfaces closer together than this along a beam give one pulse, a mixed pixel.
constexpr float kPulse_m = 0.45F;

// What rough measurements are like: deviations of the beams from their calibration (data sheets promise no less),
// shares of the light that a leaf lets through and of the beams that meet dust, rain or an insect.
constexpr double kAngleDeviation_rad = 3e-4;
constexpr double kRangeDeviation_m = 0.01;
constexpr double kLeafPasses = 0.4;
constexpr int kMostLeaves = 3;
constexpr double kFlutter_m = 0.04;
constexpr double kStray = 2e-4;
constexpr double kNearestStray_m = 0.5;
constexpr double kFarthestStray_m = 12.0;

/// A still movable object, in the truth (README of the truth folder); the product's own 3 means something else.
constexpr std::uint8_t kAtRest = 3;

float tile_variation(const MaterialProperties& m, const Eigen::Vector3d& p) {
    if (m.variation == 0.0F) return 1.0F;
    const auto cell = [&](double v) { return static_cast<std::uint64_t>(std::llround(std::floor(v / m.tile_m))); };
    const std::uint64_t tile = mix_bits(mix_bits(cell(p.x()) * 73856093U + cell(p.y())) + cell(p.z()));
    return 1.0F + m.variation * (static_cast<float>(tile >> 40) * 0x1.0p-23F - 1.0F);
}

}  // namespace

/// A pulse that came back.
struct Lidar::Echo {
    float distance_m = 0.0F;
    float energy = 0.0F;  ///< in units of what is just seen
    float reflectivity = 0.0F;
    Material material = Material::kPaving;
    std::uint16_t object = 0;
};

LidarOptics optics_of(const std::string& product_line) {
    if (product_line.starts_with("OS-0")) return {0.0061, 35.0, 0.3};
    if (product_line.starts_with("OS-2")) return {0.0016, 200.0, 0.8};
    return {0.0031, 90.0, 0.5};
}

Lidar::Lidar(const driver::SensorInfo& sensor, const World& world, double duration_s, const LidarOptions& options)
    : sensor_(sensor),
      world_(world),
      options_(options),
      optics_(optics_of(sensor.product_line)),
      rays_a_beam_(options.noise ? kSubRays : 1) {
    const driver::BitField& range = sensor.format->field(driver::PixelField::kRange);
    range_step_mm_ = 1U << range.shift;
    range_limit_mm_ = static_cast<std::uint32_t>(((std::uint64_t{1} << range.bits) - 1) << range.shift);

    const SensorModel& model = sensor.model;
    const double rim = options.noise ? 0.35 * optics_.divergence_rad : 0.0;
    for (int row = 0; row < model.height; ++row) {
        const auto r = static_cast<std::size_t>(row);
        Random random(options.seed, 0xBEA3, r);
        const auto off = [&](double deviation) { return options.rough ? deviation * random.normal() : 0.0; };
        const double azimuth = -static_cast<double>(model.azimuth_offset_rad[r]) + off(kAngleDeviation_rad);
        const double altitude = static_cast<double>(model.altitude_rad[r]) + off(kAngleDeviation_rad);
        bias_m_.push_back(static_cast<float>(off(kRangeDeviation_m)));
        Beam beam{};
        for (int i = 0; i < kSubRays; ++i) {
            const double angle = 2.0 * std::numbers::pi * i / (kSubRays - 1);
            const double a = azimuth + (i == 0 ? 0.0 : rim * std::cos(angle) / std::cos(altitude));
            const double p = altitude + (i == 0 ? 0.0 : rim * std::sin(angle));
            beam.direction[static_cast<std::size_t>(i)] =
                Vec3(std::cos(a) * std::cos(p), std::sin(a) * std::cos(p), std::sin(p));
        }
        beams_.push_back(beam);
    }

    for (const auto& actor : world.actors) {
        bool moves = false;
        for (double t = 0.0; t < duration_s && !moves; t += 0.02) moves = actor->speed(t) > kMovingSpeed_mps;
        ever_moves_.push_back(moves);
    }
}

/// A direction moved by the offset of its pulse.
Eigen::Vector3d Lidar::off_grid(const Eigen::Vector3d& direction, int index, int measurement, int row) const {
    Random random(options_.seed ^ 0x0FF6, static_cast<std::uint64_t>(index),
                  static_cast<std::uint64_t>(measurement) * 256U + static_cast<std::uint64_t>(row));
    const double azimuth = options_.off_grid_rad * (2.0 * random.uniform() - 1.0);
    const double altitude = options_.off_grid_rad * (2.0 * random.uniform() - 1.0);
    const Vec3 left = Vec3::UnitZ().cross(direction).normalized();
    return (direction + azimuth * left + altitude * direction.cross(left)).normalized();
}

void Lidar::measure(const Hit* hits, Random& random, Echo& first, Echo& second) const {
    static_assert(kShare.size() == kSubRays);
    // Energies of the beam's parts, nearest first.
    struct Glint {
        float distance_m;
        float energy;
        float reflectivity;
        int ray;
    };
    std::array<Glint, kSubRays> parts{};
    int count = 0;
    const auto limit = static_cast<float>(optics_.range_10_m);
    for (int i = 0; i < rays_a_beam_; ++i) {
        const Hit& h = hits[i];
        if (h.distance_m <= static_cast<float>(optics_.minimum_range_m)) continue;
        const MaterialProperties& m = properties_of(h.material);
        const float reflectivity = m.mirror && h.cosine > 0.985F ? 0.9F : m.reflectivity;
        const float share = rays_a_beam_ == 1 ? 1.0F : static_cast<float>(kShare[static_cast<std::size_t>(i)]);
        const float scale = limit / h.distance_m;
        // Rough surfaces send more back at a grazing angle than Lambert's law says.
        const float facing = 0.12F + 0.88F * h.cosine;
        const Glint glint{h.distance_m, share * reflectivity * facing * scale * scale / 0.1F, reflectivity, i};
        int at = count++;
        for (; at > 0 && parts[static_cast<std::size_t>(at - 1)].distance_m > glint.distance_m; --at) {
            parts[static_cast<std::size_t>(at)] = parts[static_cast<std::size_t>(at - 1)];
        }
        parts[static_cast<std::size_t>(at)] = glint;
    }
    for (int begin = 0, end = 0; begin < count; begin = end) {
        Echo echo;
        double weighted = 0.0;
        double reflectivity = 0.0;
        std::array<std::pair<const Hit*, float>, kSubRays> surfaces{};
        int surface_count = 0;
        for (end = begin; end < count; ++end) {
            const Glint& p = parts[static_cast<std::size_t>(end)];
            if (end > begin && p.distance_m - parts[static_cast<std::size_t>(end - 1)].distance_m > kPulse_m) break;
            echo.energy += p.energy;
            weighted += static_cast<double>(p.energy) * static_cast<double>(p.distance_m);
            reflectivity += static_cast<double>(p.energy) * static_cast<double>(p.reflectivity);
            int s = 0;
            const Hit& h = hits[p.ray];
            while (s < surface_count && surfaces[static_cast<std::size_t>(s)].first->object != h.object) ++s;
            if (s == surface_count) surfaces[static_cast<std::size_t>(surface_count++)] = {&h, 0.0F};
            surfaces[static_cast<std::size_t>(s)].second += p.energy;
        }
        if (echo.energy <= 0.0F) continue;
        echo.distance_m = static_cast<float>(weighted / static_cast<double>(echo.energy));
        echo.reflectivity = static_cast<float>(reflectivity / static_cast<double>(echo.energy));
        int best = 0;
        for (int s = 1; s < surface_count; ++s) {
            if (surfaces[static_cast<std::size_t>(s)].second > surfaces[static_cast<std::size_t>(best)].second)
                best = s;
        }
        echo.object = surfaces[static_cast<std::size_t>(best)].first->object;
        echo.material = surfaces[static_cast<std::size_t>(best)].first->material;
        if (options_.noise) {
            // Just seen: half of the time. Now and then nothing comes back for no reason at all.
            const double chance = std::clamp((static_cast<double>(echo.energy) - 0.5) / 1.0, 0.0, 0.998);
            if (!random.chance(chance)) continue;
            const double sigma = std::clamp(0.008 + 0.02 / std::sqrt(static_cast<double>(echo.energy)), 0.01, 0.03);
            echo.distance_m += static_cast<float>(sigma * random.normal());
        }
        if (echo.energy > first.energy) {
            second = first;
            first = echo;
        } else if (echo.energy > second.energy) {
            second = echo;
        }
    }
}

/// Light that a leaf let through goes on to what is behind.
void Lidar::pass_leaves(const RayCaster& caster, const RayBundle& rays, Random& random, Hit hits[kRaysPerCast]) const {
    bool passes[kRaysPerCast];
    std::fill(std::begin(passes), std::end(passes), true);
    for (int leaf = 0; leaf < kMostLeaves; ++leaf) {
        RayBundle behind = rays;
        bool any = false;
        for (int i = 0; i < kRaysPerCast; ++i) {
            passes[i] = passes[i] && hits[i].distance_m > 0.0F && hits[i].material == Material::kFoliage &&
                        random.chance(kLeafPasses);
            any = any || passes[i];
            if (passes[i]) behind.origin[i] += hits[i].distance_m * rays.direction[i];
        }
        if (!any) return;
        std::array<Hit, kRaysPerCast> farther;
        caster.cast(behind, farther.data());
        for (int i = 0; i < kRaysPerCast; ++i) {
            const auto& hit = farther[static_cast<std::size_t>(i)];
            if (!passes[i]) continue;
            const float before = hits[i].distance_m;
            hits[i] = hit;
            if (hit.distance_m > 0.0F) hits[i].distance_m += before;
        }
    }
}

/// Leaves flutter; now and then something in the air is met.
void Lidar::scatter(Random& random, Echo& echo) const {
    if (echo.energy > 0.0F && echo.material == Material::kFoliage && echo.object == 0) {
        echo.distance_m += static_cast<float>(kFlutter_m * random.normal());
    }
    if (random.chance(kStray)) {
        echo = {.distance_m = static_cast<float>(random.uniform(kNearestStray_m, kFarthestStray_m)),
                .energy = 1.0F,
                .reflectivity = 0.05F,
                .material = Material::kFoliage};
    }
}

void Lidar::scan(int index, RayCaster& caster, Scan& scan) const {
    const SensorModel& model = sensor_.model;
    const int H = model.height;
    const int W = model.width;
    scan.index = index;
    scan.start_s = index * turn_s();
    for (ReturnImages* images : {&scan.first, &scan.second}) {
        images->range_mm.resize(H, W);
        images->reflectivity.resize(H, W);
        images->signal.resize(H, W);
    }
    scan.near_ir.resize(H, W);
    scan.label.resize(H, W);
    scan.instance.resize(H, W);
    for (auto* image : {&scan.x, &scan.y, &scan.z}) image->resize(H, W);
    caster.set_turn(scan.start_s, scan.start_s + turn_s());

    const int first_column = model.column_window_first;
    const int columns = (model.column_window_last - first_column + W) % W + 1;
    const int beams_a_cast = kRaysPerCast / rays_a_beam_;
    const double origin_m = static_cast<double>(model.beam_origin_m);
    std::vector<std::uint8_t> label_of(world_.actors.size());
    for (int k = 0; k < columns; ++k) {
        const int m = (first_column + k) % W;
        const double t = scan.start_s + column_s(m);
        for (std::size_t a = 0; a < world_.actors.size(); ++a) {
            const bool moving = world_.actors[a]->speed(t) > kMovingSpeed_mps;
            label_of[a] = moving           ? static_cast<std::uint8_t>(PixelLabel::kDynamic)
                          : ever_moves_[a] ? kAtRest
                                           : static_cast<std::uint8_t>(PixelLabel::kStatic);
        }
        const double theta = 2.0 * std::numbers::pi * (1.0 - static_cast<double>(m) / W);
        const Eigen::Isometry3d T_world_lidar = world_.robot.T_world_sensor(t) * model.T_sensor_lidar;
        const Eigen::Matrix3d turn =
            T_world_lidar.linear() * Eigen::AngleAxisd(theta, Vec3::UnitZ()).toRotationMatrix();
        const Eigen::Vector3d origin = T_world_lidar.translation() + turn.col(0) * origin_m;

        RayBundle rays;
        rays.time = static_cast<float>(static_cast<double>(m) / W);
        for (auto& o : rays.origin) o = origin.cast<float>();
        std::array<Hit, kRaysPerCast> hits;
        for (int row = 0; row < H; row += beams_a_cast) {
            const int beams = std::min(beams_a_cast, H - row);
            for (int i = 0; i < kRaysPerCast; ++i) {
                const int beam = std::min(row + i / rays_a_beam_, H - 1);
                Vec3 d = beams_[static_cast<std::size_t>(beam)].direction[static_cast<std::size_t>(i % rays_a_beam_)];
                if (options_.off_grid_rad > 0.0) d = off_grid(d, index, m, beam);
                rays.direction[i] = (turn * d).cast<float>();
            }
            caster.cast(rays, hits.data());
            if (options_.rough) {
                Random random(options_.seed ^ 0x1EAF, static_cast<std::uint64_t>(index),
                              static_cast<std::uint64_t>(m) * 256U + static_cast<std::uint64_t>(row));
                pass_leaves(caster, rays, random, hits.data());
            }
            for (int b = 0; b < beams; ++b) {
                const int r = row + b;
                const int column = (((m + model.pixel_shift[static_cast<std::size_t>(r)]) % W) + W) % W;
                Random random(options_.seed, static_cast<std::uint64_t>(index),
                              static_cast<std::uint64_t>(m) * 256U + static_cast<std::uint64_t>(r));
                const Hit& centre = hits[static_cast<std::size_t>(b * rays_a_beam_)];
                Echo first;
                Echo second;
                measure(&centre, random, first, second);
                if (options_.rough) scatter(random, first);

                const Vec3 ray = turn * beams_[static_cast<std::size_t>(r)].direction[0];
                const float sun = centre.distance_m == 0.0F ? static_cast<float>(900.0 + 700.0 * ray.z())
                                                            : 1600.0F * properties_of(centre.material).reflectivity *
                                                                  (0.5F + 0.5F * centre.cosine);
                scan.near_ir(r, column) = static_cast<std::uint16_t>(
                    std::clamp(sun + 12.0F * static_cast<float>(random.normal()), 0.0F, 4080.0F));

                const auto store = [&](Echo& echo, ReturnImages& images) {
                    if (echo.energy <= 0.0F) return;
                    // Sensors report the distance from their axis, along the beam.
                    const auto bias_m = static_cast<double>(bias_m_[static_cast<std::size_t>(r)]);
                    const double range_mm = (static_cast<double>(echo.distance_m) + bias_m + origin_m) * 1e3;
                    const auto steps = static_cast<std::uint32_t>(std::lround(range_mm / range_step_mm_));
                    if (steps * range_step_mm_ > range_limit_mm_) return;
                    images.range_mm(r, column) = steps * range_step_mm_;
                    const double distance = static_cast<double>(echo.distance_m);
                    const float tile =
                        echo.object == 0 ? tile_variation(properties_of(echo.material), origin + ray * distance) : 1.0F;
                    const double grain = options_.noise ? 1.0 + 0.04 * random.normal() : 1.0;
                    const double reflectivity = 100.0 * static_cast<double>(echo.reflectivity * tile) * grain;
                    images.reflectivity(r, column) = static_cast<std::uint8_t>(std::clamp(reflectivity, 1.0, 255.0));
                    const double photons = 12.0 * static_cast<double>(echo.energy);
                    images.signal(r, column) = static_cast<std::uint16_t>(std::clamp(photons, 1.0, 65535.0));
                };
                store(first, scan.first);
                store(second, scan.second);
                const std::uint32_t range = scan.first.range_mm(r, column);
                if (range == 0) continue;
                const bool ground = first.object == 0 && properties_of(first.material).ground;
                scan.instance(r, column) = first.object;
                scan.label(r, column) = first.object > 0 ? label_of[first.object - 1U]
                                        : ground         ? static_cast<std::uint8_t>(PixelLabel::kGround)
                                                         : static_cast<std::uint8_t>(PixelLabel::kStatic);
                const Vec3 p = origin + ray * (static_cast<double>(range) * 1e-3 - origin_m);
                scan.x(r, column) = static_cast<float>(p.x());
                scan.y(r, column) = static_cast<float>(p.y());
                scan.z(r, column) = static_cast<float>(p.z());
            }
        }
    }
}

}  // namespace dlod::tools::sim
