#include "mission/console_hub.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>

#include "hal/together.hpp"
#include "hal/wake.hpp"
#include "mission/console_text.hpp"

namespace mission {
namespace {

constexpr hal::Duration kLostPause = std::chrono::milliseconds(200);
constexpr std::uint32_t kFirstNumberBelow = 1U << 30;
constexpr std::string_view kLostOutput = "\r\n(some output was lost: it was read too slowly)\r\n";

}  // namespace

// One session and what waits for it. To it, the robot's passwords and log are the hub's.
class ConsoleHub::Seat final : public ConsoleRobot {
 public:
  Seat(ConsoleHub& hub, hal::ByteStream& its_stream, Who its_who)
      : stream(its_stream),
        who(its_who),
        hub_(hub),
        session({its_who.may_set_first_password, hub.config_.first_number()}, *this, hub.limit_,
                hub.clock_.now()) {
    hub_.seats_.push_back(this);
  }
  ~Seat() override {
    session.log_out();  // Whoever drove by hand stands now.
    std::erase(hub_.seats_, this);
  }
  Seat(const Seat&) = delete;
  Seat& operator=(const Seat&) = delete;

  ConsoleFacts facts() const override {
    ConsoleFacts facts = hub_.robot_.facts();
    facts.has_password = hub_.has_password_;
    return facts;
  }
  std::vector<std::string> log(std::size_t lines) const override { return hub_.log(lines); }
  std::string obey(const ConsoleOrder& order) override {
    if (order.kind != ConsoleOrder::Kind::check_password &&
        order.kind != ConsoleOrder::Kind::set_password)
      return hub_.robot_.obey(order);
    job = order;  // One at a time: the session sees to that.
    job_is_first = !hub_.has_password_;
    asked.notify();
    return "";
  }

  void put(std::string_view text) {
    if (text.empty()) return;
    if (output.size() + text.size() > kOutputMax) {
      lost_output = true;
    } else {
      output += text;
    }
    filled.notify();
  }

  hal::ByteStream& stream;
  const Who who;
  hal::Wake filled, asked;
  std::string output;
  bool lost_output = false, job_is_first = false;
  std::optional<ConsoleOrder> job;

 private:
  ConsoleHub& hub_;

 public:
  ConsoleSession session;  // The last: it uses the others from its beginning to its end.
};

ConsoleHub::ConsoleHub(Config config, hal::Clock& clock, ConsoleRobot& robot, hal::Compute& compute)
    : config_(std::move(config)),
      clock_(clock),
      robot_(robot),
      compute_(compute),
      passwords_(config_.password),
      has_password_(passwords_.exists()) {
  if (!passwords_.problem().empty()) tell("nobody can log in: " + passwords_.problem());
}

ConsoleHub::~ConsoleHub() = default;

hal::Task<void> ConsoleHub::serve(hal::ByteStream& stream, Who who) {
  for (;;) {
    {
      Seat seat(*this, stream, who);
      co_await sit(seat);
    }
    if (who.link == Link::connection) co_return;
    co_await clock_.sleep_for(kLostPause);
  }
}

hal::Task<void> ConsoleHub::sit(Seat& seat) {
  seat.put(seat.session.greeting());
  co_await hal::first_of(read(seat), keep_company(seat));
}

hal::Task<void> ConsoleHub::keep_company(Seat& seat) {
  using boost::asio::experimental::awaitable_operators::operator&&;
  co_await (write(seat) && tick(seat) && do_jobs(seat));
}

// Until the link is lost, or its person leaves.
hal::Task<void> ConsoleHub::read(Seat& seat) {
  std::array<std::uint8_t, kPieceMax> piece{};
  while (!seat.session.quits()) {
    const auto size = co_await seat.stream.read_some(piece);
    if (!size) co_return;
    seat.put(seat.session.receive(std::span(piece).first(*size), clock_.now()));
    co_await clock_.sleep_for(kPause);
  }
  co_await clock_.sleep_for(kTick);  // For the last words.
}

hal::Task<void> ConsoleHub::write(Seat& seat) {
  for (;;) {
    while (seat.output.empty() && !seat.lost_output) co_await seat.filled.wait();
    std::string out = std::exchange(seat.output, {});
    if (std::exchange(seat.lost_output, false)) out += kLostOutput;
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(out.data());
    const auto written = co_await seat.stream.write({bytes, out.size()});
    if (!written) co_await clock_.sleep_for(kLostPause);  // It is gone, or read() will see.
  }
}

hal::Task<void> ConsoleHub::tick(Seat& seat) {
  for (;;) {
    co_await clock_.sleep_for(kTick);
    seat.put(seat.session.tick(clock_.now()));
  }
}

hal::Task<void> ConsoleHub::do_jobs(Seat& seat) {
  for (;;) {
    while (!seat.job) co_await seat.asked.wait();
    const ConsoleOrder job = *std::exchange(seat.job, std::nullopt);
    if (job.kind == ConsoleOrder::Kind::check_password) {
      bool is_right = false;
      const std::function<void()> check = [&] { is_right = passwords_.is(job.password); };
      co_await compute_.run(check);
      seat.put(seat.session.password_checked(is_right));
      if (!is_right) tell("somebody gave a wrong password");
      continue;
    }
    std::string problem = "somebody else has just set one";
    if (!seat.job_is_first || !has_password_) {
      const std::function<void()> set = [&] { problem = passwords_.set(job.password); };
      co_await compute_.run(set);
    }
    if (problem.empty()) {
      has_password_ = true;
      for (Seat* const each : seats_)
        if (each->session.logged_in()) each->session.log_out();
      tell("the password was set");
    }
    seat.put(seat.session.password_set(problem));
  }
}

void ConsoleHub::tell(const std::string& what) {
  log_.push_back(fmt::format("{:.1f} s  {}", hal::seconds(clock_.now()), what));
  if (log_.size() > kLogMax) log_.pop_front();
  for (Seat* const seat : seats_) seat->put(seat->session.notice(what));
}

std::vector<std::string> ConsoleHub::log(std::size_t lines) const {
  const std::size_t shown = std::min(lines, log_.size());
  return {log_.end() - static_cast<std::ptrdiff_t>(shown), log_.end()};
}

std::uint32_t unforeseeable_number() {
  if (sodium_init() < 0) return 1;  // Without random numbers nobody can set a password either.
  return 1 + randombytes_uniform(kFirstNumberBelow);
}

}  // namespace mission
