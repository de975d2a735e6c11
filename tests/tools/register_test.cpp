// vantage register and vantage localize as a person or a script runs them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include "drivers/vn100_codec.hpp"
#include "tests/tools/vantage_test.hpp"

namespace {

using testing::HasSubstr;

class RegisterTest : public test::VantageTest {
 protected:
  // A room of 12 x 8 x 4 m seen from (x, y) on its floor, turned by yaw.
  static std::string room(double x_m, double y_m, double yaw_rad) {
    std::ostringstream text;
    const auto add = [&](double wx, double wy, double wz) {
      const double dx = wx - x_m, dy = wy - y_m;
      text << std::cos(yaw_rad) * dx + std::sin(yaw_rad) * dy << ','
           << std::cos(yaw_rad) * dy - std::sin(yaw_rad) * dx << ',' << wz - 1 << '\n';
    };
    text << "x,y,z\n";
    for (double a = -6; a <= 6; a += 0.13)
      for (double b = -4; b <= 4; b += 0.13) add(a, b, 0);
    for (double z = 0; z <= 4; z += 0.13) {
      for (double a = -6; a <= 6; a += 0.13) add(a, -4, z), add(a, 4, z);
      for (double b = -4; b <= 4; b += 0.13) add(-6, b, z), add(6, b, z);
    }
    return text.str();
  }
};

TEST_F(RegisterTest, FindsThePoseAndSaysHowGoodItIs) {
  const auto reference = write("a.csv", room(0, 0, 0)),
             reading = write("b.xyz", room(0.8, 0.3, 0.1));
  const auto outcome = run("register " + reference.string() + " " + reading.string() +
                           " --guess 0.5 0 0 0 0 3 --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err << outcome.out;
  const auto json = outcome.json();
  EXPECT_EQ(json.at("verdict").as_string(), "accepted");
  EXPECT_NEAR(json.at("translation_m").at(0).to_number<double>(), 0.8, 0.02);
  EXPECT_NEAR(json.at("translation_m").at(1).to_number<double>(), 0.3, 0.02);
  EXPECT_NEAR(json.at("roll_pitch_yaw_deg").at(2).to_number<double>(), 5.73, 0.2);
  EXPECT_GT(json.at("overlap_percent").to_number<double>(), 90);
  const auto text = run("register " + reference.string() + " " + reading.string());
  EXPECT_EQ(text.code, 0);
  EXPECT_THAT(text.out, HasSubstr("accepted\n"));
  EXPECT_THAT(text.out, HasSubstr("along x"));
}

TEST_F(RegisterTest, AWrongPairIsRefusedWithExitOne) {
  const auto reference = write("a.csv", room(0, 0, 0));
  std::string heap = "x,y,z\n";
  for (int i = 0; i < 4000; ++i)
    heap += std::to_string(20 + i % 17) + "," + std::to_string(i % 23) + "," +
            std::to_string(i % 11) + "\n";
  const auto outcome =
      run("register " + reference.string() + " " + write("heap.csv", heap).string());
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.out, HasSubstr("refused: "));
}

TEST_F(RegisterTest, ABrokenFileIsNamedWithItsLine) {
  const auto reference = write("a.csv", room(0, 0, 0)),
             broken = write("b.csv", "x,y,z\n1,2,3\n1,zwei,3\n");
  const auto outcome = run("register " + reference.string() + " " + broken.string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("b.csv:3"));
  EXPECT_THAT(outcome.err, HasSubstr("'zwei' is not a number"));
  EXPECT_EQ(run("register " + reference.string() + " " + (folder_.path() / "no.ply").string()).code,
            2);
}

class LocalizeTest : public test::VantageTest {
 protected:
  // 60 s along a circle of 20 m radius at 1 m/s, from (20, 0) facing north.
  struct Logs {
    std::string odometry, imu, gnss;
  };
  static Logs circle() {
    Logs logs{"time_s,left_m,right_m\n", "time_s,yaw_rate_radps\n", "time_s,x_m,y_m,sigma_m\n"};
    for (int i = 1; i <= 1200; ++i) {
      const double t = 100 + i * 0.05, angle = i * 0.05 / 20;
      logs.odometry += std::to_string(t) + ",0.04925,0.05075\n";  // Track 0.6 m.
      logs.imu += std::to_string(t) + ",0.05\n";
      if (i % 10 == 0)
        logs.gnss += std::to_string(t) + "," + std::to_string(20 * std::cos(angle)) + "," +
                     std::to_string(20 * std::sin(angle)) + ",0.02\n";
    }
    return logs;
  }

  struct Pose {
    double t, x, y, z, qx, qy, qz, qw;
  };
  std::vector<Pose> trajectory(const std::string& name) const {
    std::ifstream file(folder_.path() / name);
    std::vector<Pose> poses;
    for (Pose p; file >> p.t >> p.x >> p.y >> p.z >> p.qx >> p.qy >> p.qz >> p.qw;)
      poses.push_back(p);
    return poses;
  }
};

TEST_F(LocalizeTest, FollowsACircleFromASurveyedStart) {
  const auto logs = circle();
  const auto outcome =
      run("localize --odometry " + write("o.csv", logs.odometry).string() + " --imu " +
          write("i.csv", logs.imu).string() + " --start 20 0 90 --json --out " +
          (folder_.path() / "way.tum").string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto poses = trajectory("way.tum");
  ASSERT_EQ(poses.size(), 1200U);
  EXPECT_NEAR(poses.back().t, 160, 1e-6);
  EXPECT_NEAR(poses.back().x, 20 * std::cos(3.0), 0.1);
  EXPECT_NEAR(poses.back().y, 20 * std::sin(3.0), 0.1);
  EXPECT_NEAR(outcome.json().at("heading_deg").to_number<double>(), 90 + 3 * 57.2958 - 360, 1);
}

TEST_F(LocalizeTest, FindsItsStartFromFixesWhileDriving) {
  const auto logs = circle();
  const auto outcome =
      run("localize --odometry " + write("o.csv", logs.odometry).string() + " --imu " +
          write("i.csv", logs.imu).string() + " --gnss " + write("g.csv", logs.gnss).string() +
          " --out " + (folder_.path() / "way.tum").string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("start found from fixes"));
  const auto poses = trajectory("way.tum");
  ASSERT_GT(poses.size(), 500U);
  EXPECT_NEAR(std::hypot(poses.back().x, poses.back().y), 20, 0.05);
}

TEST_F(LocalizeTest, SmoothsAGapWithTheFixesAfterIt) {
  // Wheels that turn too far to the left, and half a minute without fixes.
  Logs logs = circle();
  logs.odometry = "time_s,left_m,right_m\n";
  for (int i = 1; i <= 1200; ++i)
    logs.odometry += std::to_string(100 + i * 0.05) + ",0.04905,0.05075\n";
  std::istringstream fixes(logs.gnss);
  std::string seen;
  for (std::string line; std::getline(fixes, line);)
    if (line < "120" || line >= "150") seen += line + "\n";
  const auto call = "localize --odometry " + write("o.csv", logs.odometry).string() + " --gnss " +
                    write("g.csv", seen).string() + " --start 20 0 90 --out ";
  const auto worst_m = [&](const std::string& name, const std::string& option) {
    const auto outcome = run(call + (folder_.path() / name).string() + option);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    double worst = 0;
    for (const auto& p : trajectory(name))
      worst = std::max(worst, std::hypot(p.x - 20 * std::cos((p.t - 100) / 20),
                                         p.y - 20 * std::sin((p.t - 100) / 20)));
    return worst;
  };
  const double followed_m = worst_m("way.tum", ""), smoothed_m = worst_m("smooth.tum", " --smooth");
  RecordProperty("followed_m", std::to_string(followed_m));
  RecordProperty("smoothed_m", std::to_string(smoothed_m));
  EXPECT_GT(followed_m, 1);
  EXPECT_LT(smoothed_m, followed_m / 4);
  const auto followed = trajectory("way.tum"), smoothed = trajectory("smooth.tum");
  ASSERT_EQ(followed.size(), 1200U);
  ASSERT_EQ(smoothed.size(), 1200U);
  for (std::size_t i = 0; i < smoothed.size(); ++i) ASSERT_EQ(smoothed[i].t, followed[i].t) << i;
  EXPECT_NEAR(smoothed.back().x, followed.back().x,
              2e-3);  // But for a fix of its stamp nothing came.
  EXPECT_NEAR(smoothed.back().y, followed.back().y, 2e-3);
}

TEST_F(LocalizeTest, SaysWhichColumnIsMissingAndThatThereIsNoStart) {
  const auto out = " --out " + (folder_.path() / "way.tum").string();
  const auto odometry = write("o.csv", "time_s,left_m\n1,2\n").string();
  const auto missing = run("localize --start 0 0 0 --odometry " + odometry + out);
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, HasSubstr("no column right_m"));
  const auto bad = write("b.csv", "time_s,left_m,right_m\n1,0,0\n2,x,0\n").string();
  const auto number = run("localize --start 0 0 0 --odometry " + bad + out);
  EXPECT_EQ(number.code, 2);
  EXPECT_THAT(number.err, HasSubstr("b.csv:3:2: left_m: 'x' is not a number"));
  EXPECT_EQ(run("localize --odometry " + bad + out).code, 2);
  const auto logs = circle();
  const auto still =
      run("localize --odometry " + write("c.csv", logs.odometry).string() + " --gnss " +
          write("g.csv", "time_s,x_m,y_m,sigma_m\n101,20,0,0.02\n").string() + out);
  EXPECT_EQ(still.code, 1);
  EXPECT_THAT(still.err, HasSubstr("no start found: 1 of 10 satellite fixes"));
}

// Receivers' and a VN-100's own bytes, recorded by others.
TEST_F(LocalizeTest, TakesWhatReceiversAndInertialSensorsSend) {
  const auto recordings = std::filesystem::path(VANTAGE_SOURCE_DIR) / "../shared/data/recordings";
  if (!std::filesystem::exists(recordings)) GTEST_SKIP() << "no recordings";
  const auto odometry = write("o.csv", "time_s,left_m,right_m\n1,0,0\n2,0,0\n");
  const auto with = [&](const std::string& option, const std::string& file) {
    return run("localize --start 0 0 0 --json --odometry " + odometry.string() + option + " " +
               (recordings / file).string() + " --out " + (folder_.path() / "way.tum").string());
  };
  for (const std::string file :
       {"gnss/nmea-rtk.log", "gnss/ublox-neo-m8n.log", "gnss/ublox-zed-f9p-nmea.log"}) {
    const auto outcome = with(" --gnss", file);
    ASSERT_EQ(outcome.code, 0) << file << outcome.err;
    EXPECT_GT(outcome.json().at("fixes").to_number<int>(), 0) << file;
  }
  // This one was set to send other groups: named, with the remedy.
  const auto other = with(" --imu", "vn100/F00294");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("record group 1 with bits 0 and 5"));
}

TEST_F(LocalizeTest, TakesTheBytesOfAVn100) {
  std::string bytes;
  for (int i = 0; i <= 1200; ++i) {  // Turns by 0.05 rad/s to the left: z is down.
    drivers::Vn100Sample sample;
    sample.startup_ns = static_cast<std::uint64_t>(i) * 50'000'000;
    sample.rate_radps = {0, 0, -0.05F};
    sample.accel_mps2 = {0, 0, -9.80665F};
    const auto frame = drivers::encode_vn100_binary(1U << 0U | 1U << 5U | 1U << 8U, sample);
    bytes.append(frame.begin(), frame.end());
  }
  const auto logs = circle();
  const auto outcome =
      run("localize --odometry " + write("o.csv", logs.odometry).string() + " --imu " +
          write("imu.vn100", bytes).string() + " --imu-offset 100 --start 20 0 90 --json --out " +
          (folder_.path() / "way.tum").string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NEAR(outcome.json().at("heading_deg").to_number<double>(), 90 + 3 * 57.2958 - 360, 1);
  EXPECT_NEAR(outcome.json().at("x_m").to_number<double>(), 20 * std::cos(3.0), 0.2);
}

}  // namespace
