#include "mission/store.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <boost/json.hpp>
#include <fstream>
#include <limits>

#include "mission/json_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;
namespace json = boost::json;
using test::TempFolder;

void put(const fs::path& path, std::string_view text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.push_back(fs::relative(entry.path(), folder).string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(JsonText, KeepsTheOrderOfKeysAndTheLastDigit) {
  const json::object object{
      {"z", 1}, {"a", 0.1}, {"m", 2.0}, {"list", {1.0 / 3, -0.0, 1e-7, 1e300}}, {"s", "a\"b\n"}};
  EXPECT_EQ(
      json_line(object),
      R"({"z":1,"a":0.1,"m":2.0,"list":[0.3333333333333333,-0.0,1e-07,1e+300],"s":"a\"b\n"})");
  EXPECT_EQ(json::parse(json_line(object)), json::value(object));
}

TEST(JsonText, SaysNullWhereJsonHasNoNumber) {
  EXPECT_EQ(json_line(json::array{std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::quiet_NaN()}),
            "[null,null]");
}

TEST(JsonText, PrettyTextIsTheSameValue) {
  const json::value value = {{"a", {1, 2}}, {"b", {{{"c", 1.5}}, {{"d", json::object()}}}}};
  EXPECT_EQ(json::parse(json_pretty(value)), value);
  EXPECT_EQ(json_pretty({{"a", {1, 2}}, {"b", true}}), "{\n  \"a\": [1, 2],\n  \"b\": true\n}\n");
}

TEST(JsonText, RoundsToDecimals) {
  EXPECT_EQ(json_line(rounded(12.345678, 3)), "12.346");
  EXPECT_EQ(json_line(rounded(-0.0001, 3)), "0.0");
  EXPECT_EQ(rounded(1e300, 3), 1e300);
}

TEST(WriteFile, ReplacesAFileWholeAndLeavesNoPart) {
  const TempFolder folder;
  const fs::path path = folder.path() / "a.txt";
  ASSERT_TRUE(write_file(path, {"old and long"}));
  ASSERT_TRUE(write_file(path, {"ne", "", "w"}));
  EXPECT_EQ(read_file(path).value(), "new");
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"a.txt"});
}

TEST(WriteFile, LeavesTheOldFileAndNoPartWhenItFails) {
  const TempFolder folder;
  const fs::path path = folder.path() / "taken";
  put(path / "inside", "x");  // A folder of that name: the rename fails.
  const auto wrote = write_file(path, {"text"});
  ASSERT_FALSE(wrote);
  EXPECT_NE(wrote.error().text().find(path.string()), std::string::npos);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"taken", "taken/inside"}));
}

TEST(WriteFile, AFullDiskIsAnErrorThatSaysSo) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const TempFolder folder;
  const fs::path path = folder.path() / "a";
  fs::create_symlink("/dev/full", part_name(path));
  const auto wrote = write_file(path, {"text"});
  ASSERT_FALSE(wrote);
  EXPECT_EQ(wrote.error().code, boost::system::errc::no_space_on_device);
  EXPECT_TRUE(names_in(folder.path()).empty());
}

TEST(ReadFile, StopsAtItsLimit) {
  const TempFolder folder;
  ASSERT_TRUE(write_file(folder.path() / "a", {std::string(3'000'000, 'x')}));
  EXPECT_EQ(read_file(folder.path() / "a").value().size(), 3'000'000U);
  EXPECT_EQ(read_file(folder.path() / "a", 1000).error().code, boost::system::errc::file_too_large);
  EXPECT_FALSE(read_file(folder.path() / "none"));
  EXPECT_FALSE(read_file(folder.path()));
}

TEST(RunStore, MakesTheFolderAndItsParents) {
  const TempFolder folder;
  const auto store = RunStore::open(folder.path() / "runs" / "fort");
  ASSERT_TRUE(store) << store.error().text();
  EXPECT_FALSE(store->replaced());
  EXPECT_EQ(names_in(store->folder()), (std::vector<std::string>{"decisions.jsonl", "scans"}));
}

TEST(RunStore, DecisionsAreLinesInTheOrderTheyWereMade) {
  const TempFolder folder;
  RunStore store = RunStore::open(folder.path()).value();
  ASSERT_TRUE(store.decide({{"t_s", 0.5}, {"what", "station"}}));
  EXPECT_EQ(read_file(folder.path() / "decisions.jsonl").value(),
            "{\"t_s\":0.5,\"what\":\"station\"}\n");  // Without waiting for the store to close.
  ASSERT_TRUE(store.decide({{"t_s", 2.0}}));
  ASSERT_TRUE(store.finish());
  EXPECT_EQ(read_file(folder.path() / "decisions.jsonl").value(),
            "{\"t_s\":0.5,\"what\":\"station\"}\n{\"t_s\":2.0}\n");
}

TEST(RunStore, RefusesAFolderWithSomebodyElsesFiles) {
  const TempFolder folder;
  put(folder.path() / "thesis.tex", "years of work");
  const auto store = RunStore::open(folder.path());
  ASSERT_FALSE(store);
  EXPECT_NE(store.error().text().find("not empty"), std::string::npos);
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"thesis.tex"});
}

TEST(RunStore, RefusesAFileInPlaceOfAFolder) {
  const TempFolder folder;
  put(folder.path() / "file", "x");
  EXPECT_FALSE(RunStore::open(folder.path() / "file"));
  EXPECT_FALSE(RunStore::open(folder.path() / "file" / "deeper"));
}

TEST(RunStore, ReplacesAnEarlierRunAndNothingElse) {
  const TempFolder folder;
  const fs::path& at = folder.path();
  for (const char* name : {"decisions.jsonl", "report.html", "summary.json", "map.ot", "cloud.ply",
                           ".map.ot.part", "scans/0001.ply", "scans/10000.ply",
                           "scans/.0002.ply.part", "notes.txt", "scans/mine.ply"}) {
    put(at / name, "old");
  }
  const auto store = RunStore::open(at);
  ASSERT_TRUE(store);
  EXPECT_TRUE(store->replaced());
  EXPECT_EQ(names_in(at),
            (std::vector<std::string>{"decisions.jsonl", "notes.txt", "scans", "scans/mine.ply"}));
  EXPECT_EQ(read_file(at / "decisions.jsonl").value(), "");
}

TEST(RunStore, TwoRunsCannotShareAFolder) {
  const TempFolder folder;
  auto first = RunStore::open(folder.path());
  ASSERT_TRUE(first);
  ASSERT_TRUE(first->decide({{"n", 1}}));
  const auto second = RunStore::open(folder.path());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find("another process"), std::string::npos);
  EXPECT_EQ(read_file(folder.path() / "decisions.jsonl").value(), "{\"n\":1}\n");
}

TEST(RunStore, SavesEveryProductUnderItsName) {
  const TempFolder folder;
  RunStore store = RunStore::open(folder.path()).value();
  ASSERT_TRUE(store.save_scan({{1, 2, 3}}, Eigen::Isometry3d::Identity(), {7, "moat 1", 1, 1}));
  ASSERT_TRUE(store.save_cloud(CloudMerger()));
  ASSERT_TRUE(store.save_map({{0, 0, 0}, 1, 2, 2, 2},
                             [](planning::Voxel) { return planning::VoxelState::seen_empty; }));
  ASSERT_TRUE(store.save_summary({{"end", "done"}}));
  ASSERT_TRUE(store.save_report("<html></html>"));
  EXPECT_EQ(names_in(folder.path()),
            (std::vector<std::string>{"cloud.ply", "decisions.jsonl", "map.ot", "report.html",
                                      "scans", "scans/0007.ply", "summary.json"}));
  EXPECT_EQ(read_ply(store.scan_path(7)).value().W_points_m.size(), 1U);
}

}  // namespace
}  // namespace mission
