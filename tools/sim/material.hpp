// What surfaces are made of, as far as a lidar can tell.
#pragma once

#include <array>
#include <cstdint>

namespace dlod::tools::sim {

enum class Material : std::uint8_t {
    kPaving,
    kAsphalt,
    kRoadMarking,
    kGrass,
    kIndoorFloor,
    kKerb,
    kBrick,
    kPlaster,
    kConcrete,
    kRoof,
    kGlass,
    kMetal,
    kWood,
    kBark,
    kFoliage,
    kLightPaint,
    kDarkPaint,
    kRubber,
    kRetroreflector,
    kSkin,
    kHair,
    kLightCloth,
    kMediumCloth,
    kDarkCloth,
    kFur,
    kPlastic,
};

struct MaterialProperties {
    float reflectivity = 0.0F;  ///< share of the light that is scattered back, Lambertian
    float variation = 0.0F;     ///< relative spread of the reflectivity from tile to tile
    float tile_m = 1.0F;        ///< size of a tile
    bool ground = false;        ///< labelled as ground
    bool mirror = false;        ///< sends light elsewhere unless it is hit squarely
};

inline constexpr std::array<MaterialProperties, 26> kMaterials{{
    {.reflectivity = 0.28F, .variation = 0.25F, .tile_m = 1.2F, .ground = true},  // paving
    {.reflectivity = 0.14F, .variation = 0.15F, .tile_m = 0.7F, .ground = true},  // asphalt
    {.reflectivity = 0.65F, .variation = 0.10F, .tile_m = 0.5F, .ground = true},  // road marking
    {.reflectivity = 0.42F, .variation = 0.35F, .tile_m = 0.3F, .ground = true},  // grass
    {.reflectivity = 0.35F, .variation = 0.10F, .tile_m = 0.6F, .ground = true},  // indoor floor
    {.reflectivity = 0.35F, .variation = 0.15F, .tile_m = 0.8F, .ground = true},  // kerb
    {.reflectivity = 0.30F, .variation = 0.20F, .tile_m = 0.25F},                 // brick
    {.reflectivity = 0.60F, .variation = 0.08F, .tile_m = 2.0F},                  // plaster
    {.reflectivity = 0.35F, .variation = 0.12F, .tile_m = 1.5F},                  // concrete
    {.reflectivity = 0.20F, .variation = 0.15F, .tile_m = 0.4F},                  // roof
    {.reflectivity = 0.04F, .variation = 0.0F, .tile_m = 1.0F, .mirror = true},   // glass
    {.reflectivity = 0.35F, .variation = 0.10F, .tile_m = 1.0F},                  // metal
    {.reflectivity = 0.35F, .variation = 0.20F, .tile_m = 0.15F},                 // wood
    {.reflectivity = 0.22F, .variation = 0.25F, .tile_m = 0.1F},                  // bark
    {.reflectivity = 0.45F, .variation = 0.30F, .tile_m = 0.1F},                  // foliage
    {.reflectivity = 0.60F, .variation = 0.02F, .tile_m = 1.0F},                  // light paint
    {.reflectivity = 0.05F, .variation = 0.02F, .tile_m = 1.0F},                  // dark paint
    {.reflectivity = 0.06F, .variation = 0.10F, .tile_m = 0.2F},                  // rubber
    {.reflectivity = 4.00F, .variation = 0.0F, .tile_m = 1.0F},                   // retroreflector
    {.reflectivity = 0.45F, .variation = 0.0F, .tile_m = 1.0F},                   // skin
    {.reflectivity = 0.15F, .variation = 0.0F, .tile_m = 1.0F},                   // hair
    {.reflectivity = 0.60F, .variation = 0.0F, .tile_m = 1.0F},                   // light cloth
    {.reflectivity = 0.32F, .variation = 0.0F, .tile_m = 1.0F},                   // medium cloth
    {.reflectivity = 0.10F, .variation = 0.0F, .tile_m = 1.0F},                   // dark cloth
    {.reflectivity = 0.30F, .variation = 0.0F, .tile_m = 1.0F},                   // fur
    {.reflectivity = 0.45F, .variation = 0.0F, .tile_m = 1.0F},                   // plastic
}};

constexpr const MaterialProperties& properties_of(Material m) {
    return kMaterials[static_cast<std::size_t>(m)];
}

}  // namespace dlod::tools::sim
