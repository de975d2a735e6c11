// The unit files that ship, judged by systemd's own tools.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>

#include "tests/tools/vantage_test.hpp"

namespace {

const std::string kServiceFolder = VANTAGE_SOURCE_DIR "/configs/service/";

class ServiceFiles : public test::VantageTest {
 protected:
  void SetUp() override {
    VantageTest::SetUp();
    if (!std::filesystem::exists("/usr/bin/systemd-analyze")) GTEST_SKIP() << "no systemd-analyze";
  }
  test::Outcome shell(const std::string& command) const {
    const auto out = folder_.path() / "out";
    const int status = std::system((command + " >" + out.string() + " 2>&1").c_str());
    return {WEXITSTATUS(status), test::read_text(out), ""};
  }
};

// Thirteen is an exposure of 1.3.
TEST_F(ServiceFiles, ExposesTheServiceByAtMostOnePointThree) {
  const test::Outcome fits = shell("systemd-analyze security --offline=true --threshold=13 " +
                                   kServiceFolder + "vantage.service");
  EXPECT_EQ(fits.code, 0) << fits.out;
  // The same tool refuses what is open.
  std::string open = test::read_text(kServiceFolder + "vantage.service");
  open.erase(open.find("PrivateUsers=yes"), 16);
  const auto file = write("open.service", open);
  EXPECT_NE(shell("systemd-analyze security --offline=true --threshold=13 " + file.string()).code,
            0);
}

TEST_F(ServiceFiles, AreWhatSystemdUnderstands) {
  // The programs are not installed here: any takes their place.
  for (const char* name : {"vantage.service", "vantage-down.service"}) {
    std::string text = test::read_text(kServiceFolder + name);
    const auto at = text.find("/usr/bin/vantaged");
    if (at != std::string::npos) text.replace(at, 17, "/bin/true");
    write(std::string("units/") + name, text);
  }
  const test::Outcome verified = shell("systemd-analyze verify --man=no " +
                                       (folder_.path() / "units").string() + "/*.service");
  EXPECT_EQ(verified.code, 0) << verified.out;
  EXPECT_EQ(verified.out, "");
}

TEST_F(ServiceFiles, MakeTheUserAndItsFolders) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  const std::string root = (folder_.path() / "root").string();
  const test::Outcome made =
      shell("mkdir -p " + root + "/etc && systemd-sysusers --root=" + root + " " + kServiceFolder +
            "vantage.sysusers && grep -q ^vantage: " + root +
            "/etc/passwd && systemd-tmpfiles --root=" + root + " --create " + kServiceFolder +
            "vantage.tmpfiles && test -d " + root + "/var/lib/vantage/runs");
  EXPECT_EQ(made.code, 0) << made.out;
}

}  // namespace
