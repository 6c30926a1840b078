#include "tools/sim/sensor_metadata.hpp"

#include <gtest/gtest.h>

#include "driver/metadata.hpp"

namespace dlod::tools::sim {
namespace {

TEST(SensorMetadata, MadeUpSensorsAreReadWithoutComplaint) {
    for (const std::string line : {"OS0", "OS1", "OS2"}) {
        for (const int rows : {16, 32, 64, 128}) {
            const std::string name = line + "-" + std::to_string(rows);
            const driver::SensorInfo info = driver::parse_metadata(make_metadata(name), name);
            EXPECT_EQ(info.model.height, rows);
            EXPECT_EQ(info.model.width, 1024);
            EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
            for (std::size_t r = 1; r < info.model.altitude_rad.size(); ++r) {
                EXPECT_LT(info.model.altitude_rad[r], info.model.altitude_rad[r - 1]) << name << " row " << r;
            }
        }
    }
}

TEST(SensorMetadata, ModeScalesColumnsAndShifts) {
    const std::string wide = with_mode(make_metadata("OS1-64"), "2048x10");
    const driver::SensorInfo info = driver::parse_metadata(wide, "wide");
    const driver::SensorInfo usual = driver::parse_metadata(make_metadata("OS1-64"), "usual");
    EXPECT_EQ(info.model.width, 2048);
    for (std::size_t r = 0; r < info.model.pixel_shift.size(); ++r) {
        EXPECT_EQ(info.model.pixel_shift[r], 2 * usual.model.pixel_shift[r]);
    }
    const driver::SensorInfo quick = driver::parse_metadata(with_mode(wide, "512x20"), "quick");
    EXPECT_EQ(quick.frame_rate_hz, 20);
}

TEST(SensorMetadata, NonsenseIsRefusedByName) {
    for (const char* name : {"OS3-64", "OS1", "OS1-65", "OS1-x", ""}) {
        EXPECT_THROW(make_metadata(name), std::invalid_argument) << name;
    }
    EXPECT_THROW(with_mode(make_metadata("OS1-64"), "1024"), std::invalid_argument);
    EXPECT_THROW(with_profile(make_metadata("OS1-64"), "RNG99"), std::invalid_argument);
}

}  // namespace
}  // namespace dlod::tools::sim
