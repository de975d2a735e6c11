// An Ouster's settings over real TCP on this machine: from a sensor, from who is none, slowly, and
// where nobody listens.
#include <gmock/gmock.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/multiple_exceptions.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <optional>

#include "drivers/http.hpp"
#include "drivers/kept_stream.hpp"
#include "drivers/ouster_asker.hpp"
#include "drivers/real_clock.hpp"
#include "drivers/tcp_stream.hpp"
#include "sim/ouster_unit.hpp"

namespace {

using namespace std::chrono_literals;
using boost::asio::ip::tcp;
using drivers::kUseTuple;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kHere = "127.0.0.1";

std::string sensor_says(const std::string& path, const std::string& udp_dest) {
  if (path == drivers::kOusterMetadataPath)
    return drivers::http_answer(200, sim::sample_ouster_metadata());
  if (path == drivers::kOusterSettingsPath)
    return drivers::http_answer(200, drivers::ouster_settings_json({udp_dest, 7502, "NORMAL"}));
  if (path == drivers::kOusterAlertsPath)
    return drivers::http_answer(200, drivers::ouster_alerts_json({}));
  return drivers::http_answer(404, "{}");
}

// One connection after another; each answer in pieces, with a pause before each.
class Server {
 public:
  explicit Server(hal::Clock& clock) : clock_(clock) {}

  std::function<std::string(const std::string& path)> answer = [](const std::string& path) {
    return sensor_says(path, kHere);
  };
  hal::Duration pause{};
  std::size_t piece_bytes = 4096;

  // Port 0: any that is free.
  static tcp::acceptor listen(boost::asio::io_context& io, std::uint16_t port) {
    return {io, {boost::asio::ip::make_address(kHere), port}};
  }
  hal::Task<void> run(tcp::acceptor acceptor) {
    for (;;) {
      auto [error, socket] = co_await acceptor.async_accept(kUseTuple);
      if (error) co_return;
      ++connections_;
      co_await talk(socket);
    }
  }
  int connections() const { return connections_; }
  const std::vector<std::string>& asked() const { return asked_; }

 private:
  hal::Task<void> talk(tcp::socket& socket) {
    std::array<char, 1024> piece;
    for (std::string heard;;) {
      const auto [error, size] =
          co_await socket.async_read_some(boost::asio::buffer(piece), kUseTuple);
      if (error) co_return;
      heard.append(piece.data(), size);
      while (const auto question = drivers::parse_http_get(heard)) {
        heard.erase(0, question->size);
        asked_.push_back(question->path);
        const std::string text = answer(question->path);
        const bool said = co_await say(socket, text);
        if (!said) co_return;
      }
    }
  }
  hal::Task<bool> say(tcp::socket& socket, const std::string& text) {
    for (std::size_t at = 0; at < text.size(); at += piece_bytes) {
      if (pause > 0ms) co_await clock_.sleep_for(pause);
      const auto piece = boost::asio::buffer(boost::asio::buffer(text) + at, piece_bytes);
      const auto [error, size] = co_await boost::asio::async_write(socket, piece, kUseTuple);
      if (error) co_return false;
    }
    co_return true;
  }

  hal::Clock& clock_;
  int connections_ = 0;
  std::vector<std::string> asked_;
};

class OusterOverTcp : public testing::Test {
 protected:
  ~OusterOverTcp() override {
    for (auto& stop : stops_) stop->emit(boost::asio::cancellation_type::terminal);
    link_.reset();
    io_.restart();
    io_.poll();
  }

  // Returns the port.
  std::uint16_t serve(std::uint16_t port = 0) {
    tcp::acceptor acceptor = Server::listen(io_, port);
    port = acceptor.local_endpoint().port();
    spawn(server_.run(std::move(acceptor)));
    return port;
  }
  void ask_at(std::uint16_t port) {
    drivers::OusterMetadata expected;
    ASSERT_EQ(drivers::parse_ouster_metadata(sim::sample_ouster_metadata(), expected), "");
    link_.emplace(drivers::TcpAddress{kHere, port}, io_.get_executor(), clock_);
    drivers::OusterAskerConfig config;
    config.host = kHere;
    config.own_address = [this] { return link_->own_address(); };
    asker_.emplace(
        config, expected, clock_, *link_, [this] { link_->drop(); }, troubles_,
        [this](const drivers::OusterMetadata& said) { adopted_ = said.serial_number; });
    spawn(asker_->run());
  }
  // By cancellation, or by a mistake.
  static void ended(std::exception_ptr problem) {
    try {
      if (problem) std::rethrow_exception(problem);
    } catch (const boost::asio::multiple_exceptions& both) {  // Of what was joined.
      drivers::end_of_link(both.first_exception());
    } catch (const boost::system::system_error&) {
      drivers::end_of_link(problem);
    }
  }
  void spawn(hal::Task<void> task) {
    stops_.push_back(std::make_unique<boost::asio::cancellation_signal>());
    boost::asio::co_spawn(io_, std::move(task),
                          boost::asio::bind_cancellation_slot(stops_.back()->slot(), ended));
  }
  bool until(const std::function<bool()>& holds, hal::Duration patience = 60s) {
    const hal::Time late = clock_.now() + patience;
    while (!holds() && clock_.now() < late) {
      io_.restart();
      io_.run_one_for(10ms);
    }
    return holds();
  }
  // "(none)", or all of them with their details.
  std::string told() const { return text_of(troubles_.all()); }
  static std::string text_of(const std::vector<drivers::Trouble>& troubles) {
    std::string text;
    for (const drivers::Trouble& trouble : troubles)
      text += std::string(trouble.fault->name) + ": " + trouble.detail + "\n";
    return text.empty() ? "(none)" : text;
  }
  bool says(std::string_view part) const { return told().find(part) != std::string::npos; }
  bool is_well() const { return !adopted_.empty() && troubles_.all().empty(); }

  boost::asio::io_context io_{1};
  drivers::RealClock clock_;
  Server server_{clock_};
  drivers::Troubles troubles_;
  std::string adopted_;
  std::optional<drivers::TcpStream> link_;
  std::optional<drivers::OusterAsker> asker_;
  std::vector<std::unique_ptr<boost::asio::cancellation_signal>> stops_;
};

TEST_F(OusterOverTcp, ASensorIsAskedAllOverOneConnection) {
  ask_at(serve());
  ASSERT_TRUE(until([&] { return server_.asked().size() == 3; }));
  EXPECT_THAT(server_.asked(),
              ElementsAre(drivers::kOusterMetadataPath, drivers::kOusterSettingsPath,
                          drivers::kOusterAlertsPath));
  EXPECT_EQ(adopted_, "992000000042");
  EXPECT_FALSE(until([&] { return !troubles_.all().empty(); }, 1s)) << told();
  EXPECT_EQ(server_.connections(), 1);
}

TEST_F(OusterOverTcp, PacketsForAnotherComputerAreNamedByTheAddressOfTheConnection) {
  server_.answer = [](const std::string& path) { return sensor_says(path, "10.9.8.7"); };
  ask_at(serve());
  EXPECT_TRUE(until([&] { return says("sends to another computer"); })) << told();
  EXPECT_THAT(told(), HasSubstr("to 10.9.8.7; this one is 127.0.0.1"));
}

TEST_F(OusterOverTcp, WhoeverElseAnswersIsNamedUntilTheSensorDoes) {
  server_.answer = [](const std::string&) { return "SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n\r\n"; };
  ask_at(serve());
  EXPECT_TRUE(until([&] { return says("not an Ouster: no HTTP"); })) << told();
  server_.answer = [](const std::string&) { return drivers::http_answer(503, "{}"); };
  EXPECT_TRUE(until([&] { return says("status 503"); })) << told();
  EXPECT_THAT(told(), HasSubstr("settings not answered"));
  server_.answer = [](const std::string&) { return drivers::http_answer(200, "[1, 2"); };
  EXPECT_TRUE(until([&] { return says("no JSON"); })) << told();
  EXPECT_EQ(adopted_, "");
  server_.answer = [](const std::string& path) { return sensor_says(path, kHere); };
  EXPECT_TRUE(until([&] { return is_well(); })) << told();
  EXPECT_EQ(adopted_, "992000000042");
}

TEST_F(OusterOverTcp, AServerThatDawdlesIsWaitedFor) {
  const std::size_t bytes = sensor_says(std::string(drivers::kOusterMetadataPath), kHere).size();
  server_.piece_bytes = bytes / 10;
  server_.pause = 100ms;
  ask_at(serve());
  EXPECT_TRUE(until([&] { return server_.asked().size() == 3; }));
  EXPECT_EQ(adopted_, "992000000042") << told();
  EXPECT_EQ(told(), "(none)");
  EXPECT_EQ(server_.connections(), 1);
}

TEST_F(OusterOverTcp, AServerThatIsTooSlowIsNamedAndItsLateAnswersCountForNothing) {
  server_.pause = 4s;
  server_.answer = [](const std::string& path) { return sensor_says(path, "10.9.8.7"); };
  ask_at(serve());
  EXPECT_TRUE(until([&] { return says("no answer at 127.0.0.1/api/v1/sensor/metadata"); }))
      << told();
  EXPECT_THAT(told(), HasSubstr("settings not answered"));
  EXPECT_GT(server_.connections(), 1);
  EXPECT_EQ(adopted_, "");
  server_.answer = [](const std::string& path) { return sensor_says(path, kHere); };
  server_.pause = 0ms;
  EXPECT_TRUE(until([&] { return is_well(); })) << told();
}

TEST_F(OusterOverTcp, ARefusedConnectionIsNamedUntilSomebodyListens) {
  std::uint16_t port = 0;
  {
    const tcp::acceptor free = Server::listen(io_, 0);
    port = free.local_endpoint().port();
  }
  ask_at(port);
  EXPECT_TRUE(until([&] { return says("settings not answered"); })) << told();
  EXPECT_THAT(text_of(link_->troubles()), HasSubstr("connection refused"));
  EXPECT_EQ(adopted_, "");
  serve(port);
  EXPECT_TRUE(until([&] { return is_well(); })) << told();
  EXPECT_EQ(text_of(link_->troubles()), "(none)");
}

}  // namespace
