#include "daemon/output/map_store.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <set>

#include "tests/support/file_content.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

using test::content;

std::set<std::string> files_in(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

/// Points in another order than that of their cells.
std::vector<CellTable::Entry> points(std::size_t count) {
    std::vector<CellTable::Entry> entries;
    for (std::size_t i = count; i > 0; --i) {
        const auto v = static_cast<float>(i);
        entries.push_back({i, {v, 2.0F * v, -v}});
    }
    return entries;
}

/// The floats behind the header, which ends with `last_line`.
std::vector<float> floats_after(const std::string& file, const std::string& last_line) {
    const auto at = file.find(last_line);
    if (at == std::string::npos) return {};
    std::vector<float> values((file.size() - at - last_line.size()) / sizeof(float));
    std::memcpy(values.data(), file.data() + at + last_line.size(), values.size() * sizeof(float));
    return values;
}

TEST(MapStore, NamesCannotLeadOutOfTheFolder) {
    for (const char* name : {"a", "site_2", "2026-11-22", "v1.2", "A-b_c.9"}) EXPECT_TRUE(is_map_name(name)) << name;
    for (const char* name : {"", ".", "..", ".hidden", "../up", "a/b", "/etc/passwd", "a\\b", "a b", "a\nb",
                             "caf\xc3\xa9", "a;b", "$HOME", "~"}) {
        EXPECT_FALSE(is_map_name(name)) << name;
    }
    EXPECT_FALSE(is_map_name(std::string("a\0b", 3)));
    EXPECT_TRUE(is_map_name(std::string(64, 'x')));
    EXPECT_FALSE(is_map_name(std::string(65, 'x')));
}

TEST(MapStore, WritesPcdAndPlyInTheOrderOfTheCells) {
    const test::TemporaryFolder folder;
    const MapStore store({.folder = (folder.path() / "new/maps").string()});
    const auto result = store.save("hall", points(3));
    EXPECT_TRUE(result.ok) << result.text;
    EXPECT_NE(result.text.find("hall.pcd"), std::string::npos) << result.text;
    EXPECT_NE(result.text.find("3 points"), std::string::npos) << result.text;
    EXPECT_EQ(files_in(folder.path() / "new/maps"), (std::set<std::string>{"hall.pcd", "hall.ply"}));
    const std::vector<float> expected = {1, 2, -1, 2, 4, -2, 3, 6, -3};
    const auto pcd = content(folder.path() / "new/maps/hall.pcd");
    EXPECT_NE(pcd.find("POINTS 3\n"), std::string::npos);
    EXPECT_EQ(floats_after(pcd, "DATA binary\n"), expected);
    const auto ply = content(folder.path() / "new/maps/hall.ply");
    EXPECT_EQ(ply.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0U);
    EXPECT_NE(ply.find("element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"), std::string::npos);
    EXPECT_EQ(floats_after(ply, "end_header\n"), expected);
}

TEST(MapStore, WithoutANameItIsTheTime) {
    const test::TemporaryFolder folder;
    const MapStore store({.folder = folder.path().string()});
    EXPECT_TRUE(store.save("", points(1)).ok);
    const auto files = files_in(folder.path());
    ASSERT_EQ(files.size(), 2U);
    EXPECT_EQ(files.begin()->rfind("map_2", 0), 0U) << *files.begin();
    EXPECT_TRUE(is_map_name(*files.begin()));
}

TEST(MapStore, TheServicesStateDirectoryIsTheDefault) {
    const test::TemporaryFolder folder;
    ::unsetenv("STATE_DIRECTORY");
    const auto nowhere = MapStore({}).save("a", points(1));
    EXPECT_FALSE(nowhere.ok);
    EXPECT_NE(nowhere.text.find("saved_maps.folder"), std::string::npos) << nowhere.text;
    ::setenv("STATE_DIRECTORY", folder.path().c_str(), 1);
    EXPECT_TRUE(MapStore({}).save("a", points(1)).ok);
    ::unsetenv("STATE_DIRECTORY");
    EXPECT_EQ(files_in(folder.path() / "maps"), (std::set<std::string>{"a.pcd", "a.ply"}));
}

TEST(MapStore, AFullDiskLeavesWhatWasThere) {
    const test::TemporaryFolder folder;
    const MapStore store({.folder = folder.path().string()});
    ASSERT_TRUE(store.save("a", points(2)).ok);
    const auto before = content(folder.path() / "a.pcd");
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    const rlimit small{.rlim_cur = 100'000, .rlim_max = old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    const auto result = store.save("a", points(100'000));
    const auto other = store.save("b", points(100'000));
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_FALSE(result.ok);
    EXPECT_NE(result.text.find("a.pcd.part: cannot write"), std::string::npos) << result.text;
    EXPECT_FALSE(other.ok);
    EXPECT_EQ(content(folder.path() / "a.pcd"), before);
    EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"a.pcd", "a.ply"})) << "and nothing else";
}

TEST(MapStore, WhereOneOfTheTwoCannotBeReplacedNeitherIs) {
    for (const std::string unwritable : {"pcd", "ply"}) {
        const test::TemporaryFolder folder;
        const MapStore store({.folder = folder.path().string()});
        const std::string other = unwritable == "pcd" ? "ply" : "pcd";
        std::filesystem::create_directory(folder.path() / ("a." + unwritable));
        std::ofstream(folder.path() / ("a." + other)) << "what was there";
        const auto result = store.save("a", points(2));
        EXPECT_FALSE(result.ok);
        EXPECT_NE(result.text.find("a." + unwritable + ": cannot replace the file"), std::string::npos) << result.text;
        EXPECT_EQ(content(folder.path() / ("a." + other)), "what was there");
        EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"a.pcd", "a.ply"})) << "and nothing else";
    }
}

TEST(MapStore, TheHeadersTellWhetherTwoFilesAreOfOneMap) {
    const test::TemporaryFolder folder;
    const MapStore store({.folder = folder.path().string()});
    ASSERT_TRUE(store.save("a", points(2)).ok);
    ASSERT_TRUE(store.save("b", points(3)).ok);
    const auto checksum = [&](const char* name, const std::string& comment) {
        const auto file = content(folder.path() / name);
        const auto at = file.find(comment);
        return at == std::string::npos ? "none" : file.substr(at + comment.size(), 16);
    };
    EXPECT_NE(checksum("a.pcd", "\n# map "), "none");
    EXPECT_EQ(checksum("a.pcd", "\n# map "), checksum("a.ply", "\ncomment map "));
    EXPECT_EQ(checksum("b.pcd", "\n# map "), checksum("b.ply", "\ncomment map "));
    EXPECT_NE(checksum("a.pcd", "\n# map "), checksum("b.pcd", "\n# map "));
}

TEST(MapStore, AKillBetweenTheTwoIsMadeGoodByTheNextProgram) {
    const test::TemporaryFolder folder;
    const auto in = [&](const char* name) { return folder.path() / name; };
    ASSERT_TRUE(MapStore({.folder = folder.path().string()}).save("new", points(3)).ok);
    ASSERT_TRUE(MapStore({.folder = folder.path().string()}).save("hall", points(2)).ok);
    const auto new_ply = content(in("new.ply"));
    // Killed when hall.pcd had been replaced and hall.ply had not...
    std::filesystem::copy_file(in("new.pcd"), in("hall.pcd"), std::filesystem::copy_options::overwrite_existing);
    std::filesystem::rename(in("new.ply"), in("hall.ply.part"));
    // ... and before either was: what waits may be cut off.
    const auto old_ply = content(in("hall.ply"));
    std::filesystem::rename(in("new.pcd"), in("yard.pcd"));
    std::ofstream(in("yard.ply")) << "what was there";
    std::ofstream(in("yard.ply.part")) << old_ply.substr(0, old_ply.size() / 2);

    const MapStore next({.folder = folder.path().string()});
    EXPECT_EQ(content(in("hall.ply")), new_ply);
    EXPECT_FALSE(std::filesystem::exists(in("hall.ply.part")));
    EXPECT_EQ(content(in("yard.ply")), "what was there");
    EXPECT_FALSE(std::filesystem::exists(in("yard.ply.part")));
}

TEST(MapStore, WhatAKillHasLeftUnfinishedIsRemovedAndNothingElse) {
    const test::TemporaryFolder folder;
    const auto write = [&](const char* name) { std::ofstream(folder.path() / name) << "half"; };
    for (const char* name : {"hall.pcd.part", "hall.ply.part", "notes.part", ".x.pcd.part", "part"}) write(name);
    const std::set<std::string> others = {"notes.part", ".x.pcd.part", "part"};
    MapStore store({.folder = folder.path().string()});
    EXPECT_EQ(files_in(folder.path()), others) << "at the start";
    write("yard.ply.part");
    EXPECT_TRUE(store.save("", points(1)).ok);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "yard.ply.part")) << "at the next save";
}

TEST(MapStore, WhatAnotherProgramIsSavingStays) {
    const test::TemporaryFolder folder;
    std::ofstream(folder.path() / "hall.pcd.part") << "half";
    const int other = ::open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    ASSERT_EQ(::flock(other, LOCK_SH), 0);
    const MapStore store({.folder = folder.path().string()});
    EXPECT_TRUE(store.save("yard", points(1)).ok) << "two may save at a time";
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "hall.pcd.part"));
    ::close(other);
    const MapStore next({.folder = folder.path().string()});
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "hall.pcd.part"));
}

TEST(MapStore, AMapWithoutPointsReplacesNone) {
    const test::TemporaryFolder folder;
    const MapStore store({.folder = folder.path().string()});
    ASSERT_TRUE(store.save("a", points(2)).ok);
    const auto before = content(folder.path() / "a.pcd");
    EXPECT_FALSE(store.save("a", {}).ok);
    EXPECT_EQ(content(folder.path() / "a.pcd"), before);
}

TEST(MapStore, AFolderThatCannotBeUsedIsNamed) {
    const test::TemporaryFolder folder;
    std::ofstream(folder.path() / "file") << "x";
    for (const auto& place : {folder.path() / "file", std::filesystem::path("/proc/nowhere")}) {
        const auto result = MapStore({.folder = place.string()}).save("a", points(1));
        EXPECT_FALSE(result.ok);
        EXPECT_NE(result.text.find(place.string()), std::string::npos) << result.text;
    }
}

TEST(MapStore, AFullFolderTakesNoFurtherMap) {
    const test::TemporaryFolder folder;
    const MapStore store({.folder = folder.path().string(), .most = 2});
    EXPECT_TRUE(store.save("a", points(1)).ok);
    EXPECT_TRUE(store.save("b", points(1)).ok);
    const auto result = store.save("c", points(1));
    EXPECT_FALSE(result.ok);
    EXPECT_NE(result.text.find("saved_maps.most"), std::string::npos) << result.text;
    EXPECT_TRUE(store.save("b", points(2)).ok) << "one that is there can be replaced";
}

TEST(MapStore, OnAFullDiskTheOldMapStaysAndTheAnswerSaysWhy) {
    const test::SmallDisk disk(4 << 20);
    if (!disk.usable()) GTEST_SKIP() << "no file system can be mounted here";
    const MapStore store({.folder = disk.path().string()});
    ASSERT_TRUE(store.save("hall", points(1000)).ok);
    const auto pcd = content(disk.path() / "hall.pcd");
    const auto ply = content(disk.path() / "hall.ply");
    disk.fill(100'000);
    const auto result = store.save("hall", points(20'000));
    EXPECT_FALSE(result.ok);
    EXPECT_NE(result.text.find("No space left"), std::string::npos) << result.text;
    EXPECT_NE(result.text.find("hall."), std::string::npos) << result.text;
    EXPECT_TRUE(content(disk.path() / "hall.pcd") == pcd);
    EXPECT_TRUE(content(disk.path() / "hall.ply") == ply);
    EXPECT_EQ(files_in(disk.path()), (std::set<std::string>{"filler", "hall.pcd", "hall.ply"}));
    disk.clear();
    EXPECT_TRUE(store.save("hall", points(20'000)).ok);
}

}  // namespace
}  // namespace dlod::daemon
