#include "mission/main_console.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <cmath>

namespace mission {
namespace {

void add(std::vector<FaultNow>& faults, FaultCode code, std::string detail) {
  if (code == FaultCode::nothing_wrong) return;
  const auto same = [&](const FaultNow& each) {
    return each.code == code && (detail.empty() || each.detail == detail);
  };
  if (std::ranges::none_of(faults, same)) faults.push_back({code, std::move(detail)});
}

std::string detail_of(const std::string& role, const drivers::Trouble& trouble) {
  return role + ": " + std::string(trouble.fault->name) +
         (trouble.detail.empty() ? "" : ", " + trouble.detail);
}

double worse_sigma_m(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(covariance(0, 0), covariance(1, 1)));
}

}  // namespace

std::vector<FaultNow> faults_now(const RobotDrivers& drivers, const LinkTroubles& link_troubles,
                                 const GatedDrive& gate, const DiskWatch& disk) {
  std::vector<FaultNow> faults;
  if (disk.goes_home()) add(faults, FaultCode::disk_given_up, "");
  if (const auto fault = disk.fault()) add(faults, *fault, disk.why());
  if (const auto by = gate.stopped_by()) add(faults, *by, "latched: it wants a release");
  if (const auto by = gate.held_by()) add(faults, *by, "");
  for (const NamedDevice& named : drivers.devices()) {
    if (link_troubles)
      for (const drivers::Trouble& trouble : link_troubles(named.role))
        add(faults, fault_of("link", trouble.fault->name), detail_of(named.role, trouble));
    for (const drivers::Trouble& trouble : named.device->troubles())
      add(faults, fault_of(fault_role(named.role), trouble.fault->name),
          detail_of(named.role, trouble));
  }
  std::ranges::stable_sort(
      faults, [](const FaultNow& a, const FaultNow& b) { return outweighs(a.code, b.code); });
  return faults;
}

ConsoleFacts RobotConsole::facts() const {
  const GatedDrive& gate = parts_.gate;
  ConsoleFacts facts;
  facts.mode = gate.mode();
  facts.released = gate.released();
  facts.why = gate.why();
  if (facts.why.empty() && !facts.released && gate.begun())
    facts.why = "a person stopped it, or nobody has released it yet; do: `arm`";
  if (!gate.begun()) facts.why = "not all devices have started yet, or the mission is over";
  if (const auto& shown = parts_.survey.shown()) facts.mission = progress_line(*shown);
  facts.orders = parts_.survey.orders().text();
  facts.pose = parts_.survey.pilot().pose();
  facts.sigma_m = worse_sigma_m(parts_.survey.pilot().covariance());
  facts.faults = faults_now(parts_.drivers, parts_.link_troubles, gate, parts_.survey.disk());
  return facts;
}

std::string RobotConsole::obey(const ConsoleOrder& given) {
  using Kind = ConsoleOrder::Kind;
  switch (given.kind) {
    case Kind::stop:
      parts_.gate.ask_hold();
      return "the robot stands until `arm`";
    case Kind::arm:
      return arm();
    case Kind::drive:
      return drive(given.packet);
    case Kind::take_over:
      return parts_.survey.orders().give({.kind = SurveyOrders::Kind::take_over});
    case Kind::go:
      return order(
          {.kind = SurveyOrders::Kind::go, .goal = given.pose, .has_heading = given.has_heading});
    case Kind::scan:
      return order({.kind = SurveyOrders::Kind::scan});
    case Kind::pause:
      return parts_.survey.orders().give({.kind = SurveyOrders::Kind::pause});
    case Kind::resume:
      return order({.kind = SurveyOrders::Kind::resume});
    case Kind::skip:
      return order({.kind = SurveyOrders::Kind::skip});
    case Kind::home:
      return order({.kind = SurveyOrders::Kind::home});
    case Kind::restart:
      return start_again(NextStart::anew);
    case Kind::resume_from_start:
      return start_again(NextStart::from_start);
    case Kind::check_password:
    case Kind::set_password:
      break;  // The hub's.
  }
  return "";
}

std::string RobotConsole::arm() {
  if (parts_.gate.released()) return "it is armed";
  if (!parts_.gate.begun()) return "not all devices have started yet: `faults` lists what is wrong";
  parts_.gate.ask_release();
  return "asked for its release";
}

std::string RobotConsole::start_again(NextStart next) {
  const std::string_view option = next == NextStart::anew ? "--restart" : "--resume --from-start";
  if (!parts_.start_again)
    return fmt::format("it is no service: end it, and start it again with {}", option);
  parts_.start_again(next);
  return "the robot stands; the program ends, and starts again in some seconds";
}

// Standing is never refused.
std::string RobotConsole::drive(OperatorPacket packet) {
  packet.sequence = ++sequence_;
  parts_.gate.hear(packet);
  return packet.dead_man && !parts_.gate.released() ? "the robot is not armed any more: `why`" : "";
}

std::string RobotConsole::order(SurveyOrders::Order order) {
  std::string said = parts_.survey.orders().give(order);
  if (!parts_.gate.released()) said += "; but the robot is not armed: `why`, `arm`";
  return said;
}

// --- Consoles

Consoles::Consoles(const ConsoleConfig& config, RobotConsole::Parts parts,
                   boost::asio::io_context& io, hal::Clock& clock, hal::Compute& compute)
    : io_(io),
      robot_(parts),
      hub_({.password = config.password, .first_number = unforeseeable_number}, clock, robot_,
           compute),
      places_(config, io.get_executor(), clock, hub_) {
  const auto tell = [this](const std::string& what) { hub_.tell(what); };
  parts.survey.orders().tell_to(tell);
  const auto ended = [this](std::exception_ptr error) {
    over_ = true;
    if (error && !closing_) std::rethrow_exception(error);
  };
  boost::asio::co_spawn(io_, places_.run(),
                        boost::asio::bind_cancellation_slot(cancel_.slot(), ended));
}

void Consoles::end() {
  closing_ = true;
  cancel_.emit(boost::asio::cancellation_type::terminal);
  while (!over_) {
    io_.restart();
    io_.run_one();
  }
}

}  // namespace mission
