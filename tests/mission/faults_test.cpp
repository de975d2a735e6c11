// The fault table: complete, ordered, and known to the manual.
#include "mission/faults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace {

namespace fs = std::filesystem;
using mission::Action;
using mission::FaultCode;
using mission::FaultEntry;

const fs::path kRoot = VANTAGE_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(text).str();
}

TEST(Faults, StandInTheTableByTheirCodesWithRisingNumbers) {
  const std::regex id("F[0-9]{3}(-[a-z]+)+");
  std::set<std::string_view> numbers;
  for (std::size_t i = 0; i < mission::all_faults().size(); ++i) {
    const FaultEntry& fault = mission::all_faults()[i];
    EXPECT_EQ(static_cast<std::size_t>(fault.code), i) << fault.id;
    EXPECT_EQ(&mission::entry_of(fault.code), &fault);
    EXPECT_TRUE(std::regex_match(std::string(fault.id), id)) << fault.id;
    EXPECT_TRUE(numbers.empty() || fault.id.substr(1, 3) > *numbers.rbegin()) << fault.id;
    numbers.insert(fault.id.substr(1, 3));
    for (const std::string_view text : {fault.cause, fault.effect, fault.remedy}) {
      EXPECT_GE(text.size(), 4U) << fault.id;
      EXPECT_EQ(text.find('|'), text.npos) << fault.id << " would break the manual's table";
    }
  }
  EXPECT_EQ(mission::all_faults().back().code, FaultCode::unknown_fault);
}

// What scripts and people wrote down stays what it was.
TEST(Faults, KeepTheirIds) {
  EXPECT_EQ(mission::entry_of(FaultCode::estop_pressed).id, "F001-estop-pressed");
  EXPECT_EQ(mission::entry_of(FaultCode::drive_silent).id, "F012-drive-silent");
  EXPECT_EQ(mission::entry_of(FaultCode::scanner_silent).id, "F100-scanner-silent");
  EXPECT_EQ(mission::entry_of(FaultCode::disk_full).id, "F700-disk-full");
  EXPECT_EQ(mission::entry_of(FaultCode::power_cut).id, "F802-power-cut");
}

TEST(Faults, AreFoundByIdNumberAndName) {
  const FaultEntry* const silent = &mission::entry_of(FaultCode::drive_silent);
  for (const char* typed : {"F012-drive-silent", "f012-DRIVE-silent", "F012", "f12", "12", "012",
                            "drive-silent", "Drive-Silent"})
    EXPECT_EQ(mission::find_fault(typed), silent) << typed;
  EXPECT_EQ(mission::find_fault("0"), &mission::entry_of(FaultCode::nothing_wrong));
  for (const char* typed : {"", "f", "F999", "F0012", "drive", "1x", "F-12", "1/", "1:", "@", "["})
    EXPECT_EQ(mission::find_fault(typed), nullptr) << typed;
}

// --- What drivers say.

// Whose troubles the tables of a driver's source are.
const std::map<std::string, std::vector<std::string>> kRolesOf{
    {"agilex_drive.cpp", {"drive"}},
    {"agilex_faults.cpp", {"drive"}},
    {"canopen_faults.cpp", {"drive"}},
    {"cia402_troubles.cpp", {"drive"}},
    {"cola_codec.cpp", {"scanner"}},
    {"hokuyo.cpp", {"scanner"}},
    {"ouster_asker.cpp", {"scanner"}},
    {"ouster_codec.cpp", {"scanner"}},
    {"profile_loop.hpp", {"scanner"}},
    {"profile_stream.cpp", {"scanner"}},
    {"scip_codec.cpp", {"scanner"}},
    {"sick_lms.cpp", {"scanner"}},
    {"sick_lms_codec.cpp", {"scanner"}},
    {"sick_lms_startup.cpp", {"scanner"}},
    {"udp_scanner.cpp", {"scanner"}},
    {"velodyne_codec.cpp", {"scanner"}},
    {"flir_ptu.cpp", {"pan"}},
    {"ptu_codec.cpp", {"pan"}},
    {"stream_health.hpp", {"imu", "gnss"}},
    {"vn100_codec.cpp", {"imu"}},
    {"gnss_output.hpp", {"gnss"}},
    {"gpsd_client.cpp", {"gnss"}},
    {"nmea_gnss.cpp", {"gnss"}},
    {"ntrip.cpp", {"gnss"}},
    {"ublox.cpp", {"gnss"}},
    {"ubx_epochs.cpp", {"gnss"}},
    {"power_io.cpp", {"power"}},
    {"safety_map.cpp", {"power"}},
    {"victron_map.cpp", {"power"}},
    {"gs_usb_codec.cpp", {"link"}},
    {"link_trouble.cpp", {"link"}},
    {"modbus_frames.cpp", {"link"}},
};

// The names in initialisers of drivers::Fault: {value, "name", "cause" or kCause, ...}.
std::vector<std::string> fault_names_in(const std::string& source) {
  static const std::regex fault(R"re(\{\s*[^{}",]+(\([^)]*\))?,\s*"([^"]+)",\s*("|k[A-Z]))re");
  std::vector<std::string> names;
  for (std::sregex_iterator it(source.begin(), source.end(), fault), end; it != end; ++it)
    names.push_back((*it)[2].str());
  return names;
}

TEST(Faults, KnowEveryFaultOfEveryDriver) {
  std::size_t seen = 0;
  for (const auto& each : fs::directory_iterator(kRoot / "drivers")) {
    const std::string source = text_of(each.path()), file = each.path().filename();
    if (source.find("Fault k") == source.npos && source.find("Fault{") == source.npos) continue;
    const std::vector<std::string> names = fault_names_in(source);
    if (names.empty()) continue;
    const auto roles = kRolesOf.find(file);
    ASSERT_NE(roles, kRolesOf.end()) << "say whose troubles are in drivers/" << file;
    for (const std::string& role : roles->second)
      for (const std::string& name : names) {
        EXPECT_NE(mission::fault_of(role, name), FaultCode::unknown_fault)
            << "drivers/" << file << ": give '" << name << "' of " << role
            << " a place in mission/fault_names.cpp";
        ++seen;
      }
  }
  EXPECT_GE(seen, 400U);
}

TEST(Faults, GiveEachNameOfARoleOnePlaceOnly) {
  const std::string source = text_of(kRoot / "mission/fault_names.cpp");
  const std::regex entry(R"re(\{"([a-z]+)", FaultCode::[a-z_]+,\s*((?:"[^"]*"\s*)+)\})re");
  std::set<std::string> seen;
  for (std::sregex_iterator it(source.begin(), source.end(), entry), end; it != end; ++it) {
    const std::string names = std::regex_replace((*it)[2].str(), std::regex(R"("\s*)"), "");
    std::istringstream all(names);
    for (std::string name; std::getline(all, name, '|');)
      EXPECT_TRUE(seen.insert((*it)[1].str() + ": " + name).second) << name << " is there twice";
  }
  EXPECT_GE(seen.size(), 300U);
}

TEST(Faults, AreHeldForWhatNobodyForesaw) {
  EXPECT_EQ(mission::fault_of("drive", "flat tyre"), FaultCode::unknown_fault);
  EXPECT_EQ(mission::fault_of("wheel", "no answer"), FaultCode::unknown_fault);
  EXPECT_EQ(mission::fault_of("drive", ""), FaultCode::unknown_fault);
  EXPECT_EQ(mission::entry_of(FaultCode::unknown_fault).action, Action::hold);
  EXPECT_EQ(mission::fault_of("drive", "e-stop pressed"), FaultCode::estop_pressed);
  EXPECT_EQ(mission::fault_of("scanner", "no answer"), FaultCode::scanner_silent);
  EXPECT_EQ(mission::fault_of("power", "no answer"), FaultCode::power_silent);
  EXPECT_EQ(mission::fault_of("link", "no answer"), FaultCode::link_unreachable);
  EXPECT_EQ(mission::fault_of("pan", "not understood"), FaultCode::pan_other_device);
}

// --- Order.

TEST(Faults, HaveATotalOrder) {
  for (const FaultEntry& a : mission::all_faults()) {
    EXPECT_FALSE(mission::outweighs(a.code, a.code)) << a.id;
    for (const FaultEntry& b : mission::all_faults()) {
      const bool one = mission::outweighs(a.code, b.code),
                 other = mission::outweighs(b.code, a.code);
      EXPECT_EQ(one != other, &a != &b) << a.id << " and " << b.id;
      for (const FaultEntry& c : mission::all_faults()) {
        const bool chain = one && mission::outweighs(b.code, c.code);
        ASSERT_TRUE(!chain || mission::outweighs(a.code, c.code)) << a.id << b.id << c.id;
      }
    }
  }
}

TEST(Faults, GiveTheGravestActionOfEverySubset) {
  const std::vector<FaultCode> faults{
      FaultCode::drive_loaded,  FaultCode::estop_pressed,  FaultCode::scanner_silent,
      FaultCode::imu_silent,    FaultCode::battery_low,    FaultCode::disk_full,
      FaultCode::drive_silent,  FaultCode::pose_uncertain, FaultCode::planner_late,
      FaultCode::program_fault, FaultCode::scan_disturbed, FaultCode::unknown_fault};
  for (unsigned subset = 1; subset < 1U << faults.size(); ++subset) {
    std::vector<FaultCode> present;
    Action most = Action::note;
    for (std::size_t i = 0; i < faults.size(); ++i)
      if ((subset >> i & 1U) != 0) {
        present.push_back(faults[i]);
        most = std::max(most, mission::entry_of(faults[i]).action);
      }
    const auto gravest = mission::gravest(present);
    ASSERT_TRUE(gravest);
    ASSERT_EQ(mission::entry_of(*gravest).action, most) << "subset " << subset;
    for (const FaultCode each : present) ASSERT_FALSE(mission::outweighs(each, *gravest));
    std::ranges::reverse(present);
    ASSERT_EQ(mission::gravest(present), gravest) << "it depends on the order";
  }
  EXPECT_EQ(mission::gravest({}), std::nullopt);
}

TEST(Faults, NameTheirActions) {
  EXPECT_EQ(mission::name(Action::note), "note");
  EXPECT_EQ(mission::name(Action::rescan), "rescan");
  EXPECT_EQ(mission::name(Action::home), "home");
  EXPECT_EQ(mission::name(Action::hold), "hold");
  EXPECT_EQ(mission::name(Action::stop), "stop");
}

TEST(Faults, StandInTheManualAsInTheProgram) {
  EXPECT_EQ(text_of(kRoot / "docs/faults.md"), mission::faults_page())
      << "vantage explain --all --markdown > docs/faults.md";
}

}  // namespace
