// A real gpsd, which reads a recorded receiver on a pseudo terminal in real time, and our client.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <cmath>
#include <filesystem>
#include <map>

#include "drivers/gnss_demux.hpp"
#include "drivers/gpsd_client.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/peers.hpp"
#include "drivers/real_clock.hpp"
#include "drivers/tcp_stream.hpp"
#include "tests/drivers/recordings.hpp"

namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using drivers::Bytes;

std::string gpsd_program() {
  for (const char* path : {"/usr/sbin/gpsd", "/usr/local/sbin/gpsd"})
    if (::access(path, X_OK) == 0) return path;
  return {};
}

std::uint16_t free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  EXPECT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&at), size), 0);
  EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size), 0);
  ::close(socket);
  return ntohs(at.sin_port);
}

class Gpsd {
 public:
  Gpsd(const std::string& program, std::uint16_t port, const std::string& device) {
    std::string port_text = std::to_string(port), name = "gpsd", path = device;
    std::string foreground = "-N", at_once = "-n", on = "-S";
    char* arguments[] = {name.data(),      foreground.data(), at_once.data(), on.data(),
                         port_text.data(), path.data(),       nullptr};
    EXPECT_EQ(::posix_spawn(&process_, program.c_str(), nullptr, nullptr, arguments, environ), 0);
  }
  ~Gpsd() {
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  Gpsd(const Gpsd&) = delete;
  Gpsd& operator=(const Gpsd&) = delete;

 private:
  pid_t process_{};
};

// The recording's epochs: their sentences, and what our codec makes of them.
struct Recorded {
  std::vector<Bytes> epochs;
  std::map<std::int64_t, drivers::GnssEpoch> by_time_ns;
};

Recorded recorded(std::string_view log) {
  Recorded all;
  drivers::NmeaEpochs grouping;
  Bytes sentences;
  for (const Bytes& frame : drivers_test::frames_in(drivers::as_bytes(log), drivers::look_gnss,
                                                    drivers::kGnssFrameMax)) {
    const auto sentence = drivers::parse_nmea(frame);
    if (!sentence) continue;
    sentences.insert(sentences.end(), frame.begin(), frame.end());
    for (const auto& epoch : grouping.add(*sentence)) {
      if (epoch.time_of_day_ns) all.by_time_ns[*epoch.time_of_day_ns] = epoch;
      all.epochs.push_back(std::exchange(sentences, {}));
    }
  }
  return all;
}

struct Served {
  explicit Served(const Recorded& log) : log_(log) {
    const std::string pattern = (fs::temp_directory_path() / "vantage-gpsd-XXXXXX").string();
    std::vector<char> path(pattern.begin(), pattern.end());
    path.push_back('\0');
    folder_ = ::mkdtemp(path.data());
    fs::permissions(folder_, fs::perms::all);
    device_ = (folder_ / "receiver").string();
    receiver_ = std::make_unique<drivers::PtyPeer>(device_, io_.get_executor(), clock_);
    io_.poll();
    ::chmod(device_.c_str(), 0666);  // gpsd gives up being root before it opens it.
  }
  ~Served() {
    client_.reset();
    tcp_.reset();
    receiver_.reset();
    fs::remove_all(folder_);
  }

  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io_, std::move(task), [](std::exception_ptr error) {
      if (error) std::rethrow_exception(error);
    });
  }

  // Ten epochs a second, over and over: gpsd takes a while to know its receiver.
  hal::Task<void> play() {
    for (const Bytes& epoch : log_.epochs) {
      (void)co_await receiver_->write(epoch);
      co_await clock_.sleep_for(100ms);
    }
  }
  // gpsd asks the receiver who it is; this one says nothing.
  hal::Task<void> ignore_questions() {
    std::array<std::uint8_t, 512> piece;
    for (;;) {
      const auto size = co_await receiver_->read_some(piece);
      if (!size) co_await clock_.sleep_for(100ms);
    }
  }
  hal::Task<void> take() {
    for (;;) {
      const auto fix = co_await client_->next_fix();
      if (!fix) continue;
      fixes.push_back(*fix);
      epochs.push_back(client_->output().last());
    }
  }

  void run(const std::string& program, std::size_t wanted) {
    const std::uint16_t port = free_port();
    const Gpsd gpsd(program, port, device_);
    tcp_ = std::make_unique<drivers::TcpStream>(drivers::TcpAddress{"127.0.0.1", port},
                                                io_.get_executor(), clock_);
    drivers::GpsdClientConfig config;
    config.output.anchor = {41.5749, -93.7506, 246, 0};
    config.output.rate_hz = 10;
    client_ = std::make_unique<drivers::GpsdClient>(config, clock_, *tcp_);
    spawn(ignore_questions());
    spawn(play());
    spawn(client_->run());
    spawn(take());
    const hal::Time late = clock_.now() + 30s;
    while (fixes.size() < wanted && clock_.now() < late) io_.run_one_for(50ms);
    identity = client_->identity();
    devices = client_->devices();
  }

  std::vector<hal::GnssFix> fixes;
  std::vector<drivers::GnssEpoch> epochs;
  drivers::Identity identity;
  std::vector<drivers::GpsdDevice> devices;
  const std::string& device() const { return device_; }

 private:
  const Recorded& log_;
  boost::asio::io_context io_;
  drivers::RealClock clock_;
  fs::path folder_;
  std::string device_;
  std::unique_ptr<drivers::PtyPeer> receiver_;
  std::unique_ptr<drivers::TcpStream> tcp_;
  std::unique_ptr<drivers::GpsdClient> client_;
};

TEST(GpsdInterop, ARealGpsdServesTheRecordingToOurClient) {
  RECORDING_OR_SKIP(text, "gnss/nmea-rtk.log");
  const std::string program = gpsd_program();
  if (program.empty()) GTEST_SKIP() << "no gpsd: tools/setup --peers installs it";
  const Recorded log = recorded(text);
  ASSERT_GT(log.epochs.size(), 100U);
  Served served(log);
  served.run(program, 40);
  ASSERT_GE(served.fixes.size(), 40U) << "within 30 s";
  EXPECT_EQ(served.identity.model, "gpsd");
  EXPECT_FALSE(served.identity.firmware.empty());
  ASSERT_EQ(served.devices.size(), 1U);
  EXPECT_EQ(served.devices[0].path, served.device());
  std::size_t compared = 0;
  for (const drivers::GnssEpoch& epoch : served.epochs) {
    ASSERT_TRUE(epoch.time_of_day_ns);
    const auto found = log.by_time_ns.find(*epoch.time_of_day_ns);
    ASSERT_NE(found, log.by_time_ns.end());
    EXPECT_NEAR(epoch.latitude->deg(), found->second.latitude->deg(), 0.51e-9);
    EXPECT_NEAR(epoch.longitude->deg(), found->second.longitude->deg(), 0.51e-9);
    EXPECT_EQ(epoch.quality, found->second.quality);
    EXPECT_EQ(epoch.mode, found->second.mode);
    ++compared;
  }
  EXPECT_GE(compared, 40U);
  // One fix for each instant, though gpsd reports each more than once.
  for (std::size_t i = 1; i < served.epochs.size(); ++i)
    EXPECT_GT(*served.epochs[i].time_of_day_ns, *served.epochs[i - 1].time_of_day_ns);
}

}  // namespace
