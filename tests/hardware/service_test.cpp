// `vantaged --service` as its service manager sees it. None of its devices is there: it waits.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "mission/beams_file.hpp"
#include "mission/main_run.hpp"
#include "mission/main_service.hpp"
#include "mission/main_serving.hpp"
#include "mission/resume.hpp"
#include "tests/tools/vantage_test.hpp"

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

const fs::path kServedYard = VANTAGE_SOURCE_DIR "/tests/yard";
constexpr const char* kWatchdogUs = "800000";

class Service : public test::VantageTest {
 protected:
  void SetUp() override {
    VantageTest::SetUp();
    for (const char* name : {"footprint.geojson", "mission.toml", "model.obj"})
      write(std::string("yard/") + name, test::read_text(kServedYard / name));
    robot(R"("hardware")");
    fs::create_directories(state_);
    listen();
  }
  void TearDown() override {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, __WALL);
    }
    close(notified_);
  }

  void robot(const std::string& backend) {
    std::string text = test::read_text(kServedYard / "robot.toml");
    text.replace(text.find("\"sim\""), 5, backend);
    write("yard/robot.toml", text + "[drive]\nlink = \"can:vantage9\"\n[console]\nsocket = \"" +
                                 console_path() + "\"\npassword = \"" +
                                 (folder_.path() / "password").string() + "\"\n");
  }
  static sockaddr_un unix_address(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(path.begin(), path.end(), address.sun_path);
    return address;
  }
  void listen() {
    notified_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const sockaddr_un address = unix_address(notify_path());
    ASSERT_EQ(bind(notified_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  std::string notify_path() const { return (folder_.path() / "notify").string(); }
  std::string console_path() const { return (folder_.path() / "console").string(); }

  // An operator sets the first password, logs in, and orders that.
  std::string order(const std::string& what) const {
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_un address = unix_address(console_path());
    const auto late = std::chrono::steady_clock::now() + 30s;
    while (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
           std::chrono::steady_clock::now() < late)
      std::this_thread::sleep_for(50ms);
    std::string heard;
    const auto say = [&](const std::string& line, const std::string& answer) {
      const std::size_t from = heard.size();
      const std::string typed = line + "\r";
      if (send(fd, typed.data(), typed.size(), MSG_NOSIGNAL) < 0) return;
      while (heard.find(answer, from) == std::string::npos &&
             std::chrono::steady_clock::now() < late) {
        timeval wait{1, 0};
        setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
        std::array<char, 4096> buffer{};
        const ssize_t size = recv(fd, buffer.data(), buffer.size(), 0);
        if (size > 0) heard.append(buffer.data(), static_cast<std::size_t>(size));
        if (size == 0) return;
      }
    };
    const bool first = !fs::exists(folder_.path() / "password");
    say(first ? "set-password" : "login", "password: ");
    if (first) say("crossing the yard", "again: ");
    say("crossing the yard", first ? "the password is set" : "logged in");
    if (first) say("login", "password: "), say("crossing the yard", "logged in");
    say(what, "vantage# ");
    close(fd);
    return heard;
  }

  // As systemd starts it.
  void start(bool watched = true) {
    const std::string program = std::string(VANTAGE_BINARY_DIR) + "/vantaged";
    const std::string mission = (folder_.path() / "yard/mission.toml").string();
    const std::string out = (state_ / "runs").string(), err = (folder_.path() / "err").string();
    pid_ = fork();
    ASSERT_GE(pid_, 0);
    if (pid_ > 0) return;
    setenv("NOTIFY_SOCKET", notify_path().c_str(), 1);
    setenv("STATE_DIRECTORY", state_.c_str(), 1);
    if (watched) setenv("WATCHDOG_USEC", kWatchdogUs, 1);
    const int file = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execl(program.c_str(), "vantaged", "--service", "--quiet", "--out", out.c_str(),
          mission.c_str(), nullptr);
    _exit(127);
  }

  // A run of this mission with two scans, as a cut leaves it.
  void leave_run() const {
    const fs::path run = state_ / "runs/0001", file = folder_.path() / "yard/mission.toml";
    fs::create_directories(run / "scans");
    const auto prepared = mission::prepare(file, {}, mission::WorldUse::backend);
    const auto inputs = mission::run_inputs(file, prepared.config).value();
    std::vector<mission::JournalEvent> events;
    const auto add = [&](const mission::EventText& event) {
      events.push_back({0, hal::Time{}, event.kind, event.text});
    };
    add(mission::event_of(mission::RunBegun{"yard", "hardware", inputs}));
    for (const int number : {1, 2}) {
      mission::ScanDone scan;
      scan.scan.number = number;
      scan.scan.name = "station " + std::to_string(number);
      const fs::path beams = run / "scans" / ("000" + std::to_string(number) + ".beams");
      scan.beams_checksum = mission::write_beams(beams, {}).value();
      add(mission::event_of(scan));
    }
    mission::Whereabouts where;
    where.believed.position_m = {4, 4};
    add(mission::event_of(where));
    ASSERT_TRUE(mission::JournalFile::open(run / "journal.sqlite")->append(events));
  }

  // The next message; empty: none for so long.
  std::string next(std::chrono::milliseconds patience) const {
    timeval wait{patience.count() / 1000, patience.count() % 1000 * 1000};
    setsockopt(notified_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    std::array<char, 8192> buffer{};
    const ssize_t size = recv(notified_, buffer.data(), buffer.size(), 0);
    return size > 0 ? std::string(buffer.data(), static_cast<std::size_t>(size)) : "";
  }
  // Whether such a message comes within half a minute.
  bool hears(const std::string& part) const {
    const auto late = std::chrono::steady_clock::now() + 30s;
    while (std::chrono::steady_clock::now() < late)
      if (next(1s).find(part) != std::string::npos) return true;
    return false;
  }
  int fed_within(std::chrono::milliseconds span) const {
    const auto end = std::chrono::steady_clock::now() + span;
    int fed = 0;
    while (std::chrono::steady_clock::now() < end) fed += next(20ms) == "WATCHDOG=1";
    return fed;
  }
  void forget() const {
    while (!next(1ms).empty()) {
    }
  }

  int exit_code() {
    int status = 0;
    waitpid(std::exchange(pid_, 0), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string last_run() const { return test::read_text(state_ / "last_run"); }
  std::string said() const { return test::read_text(folder_.path() / "err"); }

  const fs::path state_ = folder_.path() / "state";
  int notified_ = -1;
  pid_t pid_ = 0;
};

TEST_F(Service, IsReadyWhenItLooksForDevicesAndSaysWhatItWaitsFor) {
  start();
  EXPECT_TRUE(hears("READY=1"));
  EXPECT_TRUE(hears("STATUS=waits for drive (agilex-scout2 at can:vantage9): not there"));
  EXPECT_GE(fed_within(2s), 4);
  EXPECT_THAT(last_run(), HasSubstr("running "));

  kill(pid_, SIGTERM);
  EXPECT_TRUE(hears("STOPPING=1"));
  EXPECT_EQ(exit_code(), 3) << said();
  EXPECT_THAT(last_run(), HasSubstr("held ")) << "nothing was known of a run before";
  EXPECT_TRUE(fs::exists(state_ / "runs/0001/report.html"));
  EXPECT_THAT(said(), HasSubstr("memory at the start: "));
  EXPECT_THAT(said(), HasSubstr("memory at the end: "));
}

TEST_F(Service, KeepsEachRun) {
  for (int run = 0; run < 2; ++run) {
    start(false);
    ASSERT_TRUE(hears("READY=1")) << said();
    kill(pid_, SIGTERM);
    EXPECT_EQ(exit_code(), 3);
  }
  EXPECT_TRUE(fs::exists(state_ / "runs/0001/report.html"));
  EXPECT_TRUE(fs::exists(state_ / "runs/0002/report.html"));
}

TEST_F(Service, IsStoppedUntilAPersonReleasesItAfterACrashAndNotAfterAnOrderlyEnd) {
  write("state/last_run", "ended anything\n");
  start();
  ASSERT_TRUE(hears("READY=1"));
  EXPECT_TRUE(hears("STATUS=waits for"));
  EXPECT_THAT(said(), Not(HasSubstr("the robot is stopped")));
  kill(pid_, SIGSEGV);
  EXPECT_EQ(exit_code(), -1);
  start();
  EXPECT_TRUE(hears("STATUS=the robot is stopped: F800-program-fault"));
}

TEST_F(Service, TakesWhatSystemdSaysOfTheLastEnd) {
  start();
  ASSERT_TRUE(hears("READY=1"));
  kill(pid_, SIGKILL);
  exit_code();
  write("state/stopped_with", "watchdog ABRT\n");
  start();
  EXPECT_TRUE(hears("STATUS=the robot is stopped: F801-watchdog-restart"));
  EXPECT_FALSE(fs::exists(state_ / "stopped_with"));
}

// One thread alone stands still: as if the event loop hung.
TEST_F(Service, IsNotFedWhenItsEventLoopHangsWhichItNames) {
  start();
  ASSERT_TRUE(hears("READY=1"));
  ASSERT_TRUE(hears("WATCHDOG=1"));
  ASSERT_EQ(ptrace(PTRACE_SEIZE, pid_, nullptr, nullptr), 0) << "not permitted here?";
  ASSERT_EQ(ptrace(PTRACE_INTERRUPT, pid_, nullptr, nullptr), 0);
  EXPECT_TRUE(hears("STATUS=hangs: the "));
  forget();
  EXPECT_EQ(fed_within(1500ms), 0);
  EXPECT_THAT(said(), testing::AnyOf(HasSubstr("hangs: the event loop was due"),
                                     HasSubstr("hangs: the gate cycle was due")));
  EXPECT_THAT(said(), HasSubstr("F801-watchdog-restart"));
  EXPECT_THAT(last_run(), HasSubstr("hung "));
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, __WALL);
  start();
  EXPECT_TRUE(hears("STATUS=the robot is stopped: F801-watchdog-restart"));
}

// A stop is ended by a person's release, not by ending the program.
TEST_F(Service, DoesNotStartByItselfWhereTheLastRunLeftTheRobotStopped) {
  for (const auto& [last, held] : {std::pair("held x\n", true), std::pair("ended x\n", false)}) {
    write("state/last_run", last);
    mission::Service service(state_);
    mission::Prepared prepared;
    prepared.config.start = "on-boot";
    boost::asio::io_context io;
    const mission::Serving serving(service, prepared, {}, io);
    mission::GuardedSurvey::Config config;
    serving.configure(config);
    EXPECT_EQ(config.starts_held, held) << last;
  }
}

TEST_F(Service, CheckConfigOnReloadAndSaysWhatTheNextStartWouldChange) {
  start();
  ASSERT_TRUE(hears("READY=1"));
  kill(pid_, SIGHUP);
  EXPECT_TRUE(hears("RELOADING=1"));
  EXPECT_TRUE(hears("STATUS=config: in order; no value changes"));
  EXPECT_TRUE(hears("READY=1"));

  std::string mission = test::read_text(kServedYard / "mission.toml");
  write("yard/mission.toml", "seed = 7\n" + mission);
  kill(pid_, SIGHUP);
  EXPECT_TRUE(hears("STATUS=at the next start: seed: 7 instead of 1"));

  write("yard/mission.toml", "sede = 7\n" + mission);
  kill(pid_, SIGHUP);
  EXPECT_TRUE(hears("unknown key 'sede'"));
  EXPECT_TRUE(hears("would not start again"));
  EXPECT_GE(fed_within(1s), 2) << "it goes on";
}

TEST_F(Service, GoesOnWithTheRunThatItLeft) {
  leave_run();
  start();
  EXPECT_TRUE(hears("READY=1"));
  EXPECT_THAT(said(), HasSubstr("an unfinished run of yard lies in"));
  EXPECT_THAT(said(), Not(HasSubstr("begins a new run")));
  EXPECT_FALSE(fs::exists(state_ / "runs/0002"));
  kill(pid_, SIGTERM);
  EXPECT_EQ(exit_code(), 3) << said();
  const auto left = mission::find_left_run(state_ / "runs/0001");
  ASSERT_TRUE(left && left->has_value());
  EXPECT_EQ((*left)->history.resumed, 1);
  EXPECT_EQ((*left)->history.scans().size(), 2U);
  EXPECT_TRUE((*left)->history.where);
}

TEST_F(Service, BeginsANewRunWhenAnOperatorOrdersIt) {
  leave_run();
  start();
  ASSERT_TRUE(hears("READY=1"));
  EXPECT_THAT(order("restart"), HasSubstr("the program ends, and starts again"));
  EXPECT_EQ(exit_code(), 5) << said();
  EXPECT_TRUE(fs::exists(state_ / "runs/0001/report.html"));
  for (const char* run : {"0002", "0003"}) {  // What was ordered counts once.
    start();
    ASSERT_TRUE(hears("READY=1"));
    EXPECT_EQ(said().find("as an operator ordered") != std::string::npos, run[3] == '2');
    EXPECT_TRUE(fs::exists(state_ / "runs" / run));
    kill(pid_, SIGTERM);
    EXPECT_EQ(exit_code(), 3);
  }
  const auto left = mission::find_left_run(state_ / "runs/0001");
  ASSERT_TRUE(left && left->has_value());
  EXPECT_EQ((*left)->history.scans().size(), 2U);
}

// It forgets where the run last knew it to be.
TEST_F(Service, TakesTheRobotToStandAtItsStartWhenAnOperatorSaysSo) {
  leave_run();
  start();
  ASSERT_TRUE(hears("READY=1"));
  EXPECT_THAT(order("resume from-start"), HasSubstr("the program ends, and starts again"));
  EXPECT_EQ(exit_code(), 5) << said();
  start();
  ASSERT_TRUE(hears("READY=1"));
  EXPECT_THAT(said(), HasSubstr("goes on from the start, as an operator ordered at the console"));
  EXPECT_FALSE(fs::exists(state_ / "runs/0002"));
  kill(pid_, SIGKILL);
  exit_code();
  const auto left = mission::find_left_run(state_ / "runs/0001");
  ASSERT_TRUE(left && left->has_value());
  EXPECT_FALSE((*left)->history.where) << "another cut must not bring back the old place";
}

TEST_F(Service, BeginsANewRunWhereItCannotGoOnAndTouchesNothing) {
  leave_run();
  write("yard/mission.toml", "seed = 7\n" + test::read_text(kServedYard / "mission.toml"));
  start();
  EXPECT_TRUE(hears("READY=1"));
  EXPECT_THAT(said(), HasSubstr("begins a new run instead: the mission file"));
  EXPECT_TRUE(fs::exists(state_ / "runs/0002"));
  const auto left = mission::find_left_run(state_ / "runs/0001");
  ASSERT_TRUE(left && left->has_value());
  EXPECT_EQ((*left)->history.resumed, 0);
}

TEST_F(Service, BeginsANewRunWhereAScanOfTheOldOneIsDamaged) {
  leave_run();
  fs::resize_file(state_ / "runs/0001/scans/0001.beams", 70);
  start();
  EXPECT_TRUE(hears("READY=1"));
  EXPECT_THAT(said(), HasSubstr("begins a new run instead: "));
  EXPECT_THAT(said(), HasSubstr("0001.beams"));
  EXPECT_TRUE(fs::exists(state_ / "runs/0002"));
}

TEST_F(Service, IsRefusedWithASimulatedRobotAndLeavesNothing) {
  robot(R"("sim")");
  start();
  EXPECT_EQ(exit_code(), 2);
  EXPECT_THAT(said(), HasSubstr("a service runs real devices; write backend = \"hardware\""));
  EXPECT_TRUE(fs::is_empty(state_));
}

}  // namespace
