#include "mission/survey_orders.hpp"

#include <utility>

namespace mission {

std::string_view name(SurveyOrders::Kind kind) {
  static constexpr std::string_view kNames[]{"pause",     "resume", "skip", "home",
                                             "take over", "goto",   "scan"};
  return kNames[static_cast<std::size_t>(kind)];
}

void SurveyOrders::begin(bool has_robot) {
  running_ = true;
  has_robot_ = has_robot;
}

std::string SurveyOrders::give(Order order) {
  if (!running_) return "there is no mission";
  if (given_.size() >= kGivenMax) return "too many orders at once: wait a moment";
  order.given_at = clock_.now();
  given_.push_back(order);
  std::string said;
  switch (order.kind) {
    case Kind::pause:
      said = pause();
      break;
    case Kind::resume:
      said = resume();
      break;
    case Kind::skip:
      said = skip();
      break;
    case Kind::home:
      said = home();
      break;
    case Kind::take_over:
      said = take_over();
      break;
    case Kind::go:
    case Kind::scan:
      said = send(order);
      break;
  }
  changed_.notify();
  return said;
}

std::string SurveyOrders::pause() {
  if (waits_ && !on_errand_ && !errand_) return "the mission waits already";
  waits_ = true;
  errand_.reset();
  if (scanning_) return "the mission waits when this scan is finished";
  interrupt();
  return "the mission waits";
}

std::string SurveyOrders::resume() {
  if (!waits_) return "the mission does not wait";
  waits_ = false;
  return on_errand_ || errand_ ? "the mission goes on afterwards" : "the mission goes on";
}

std::string SurveyOrders::skip() {
  skip_ = true;
  if (!on_errand_) interrupt();
  return waits_ ? "its next station is left out when the mission goes on"
                : "the station is left out";
}

std::string SurveyOrders::home() {
  if (goes_home_ || home_) return "it is on its way home";
  if (!has_robot_) return "this mission has no robot that could drive";
  home_ = true;
  waits_ = false;
  errand_.reset();
  interrupt();
  return "the mission ends, and the robot drives home";
}

std::string SurveyOrders::take_over() {
  waits_ = moved_ = true;
  errand_.reset();
  interrupt();
  return "the mission waits";
}

std::string SurveyOrders::send(const Order& errand) {
  if (!has_robot_) return "this mission has no robot that could be sent";
  if (errand.kind == Kind::scan && scanning_) return "a scan is being taken";
  waits_ = true;
  moved_ = moved_ || errand.kind == Kind::go;
  errand_ = errand;
  interrupt();
  return errand.kind == Kind::go ? "it drives there; the mission waits"
                                 : "it scans; the mission waits";
}

void SurveyOrders::interrupt() {
  interrupted_ = true;
}

hal::Task<void> SurveyOrders::until_interrupted() {
  while (!interrupted_) co_await changed_.wait();
}

std::string SurveyOrders::text() const {
  if (!running_) return {};
  if (on_errand_) return "on an errand of the operator's";
  if (waits_) return "the mission waits for the operator's `resume`";
  return goes_home_ || home_ ? home_why_ : "";
}

void SurveyOrders::tell(const std::string& what) const {
  if (tell_) tell_(what);
}

std::vector<SurveyOrders::Order> SurveyOrders::take_given() {
  return std::exchange(given_, {});
}

std::optional<SurveyOrders::Order> SurveyOrders::take_errand() {
  on_errand_ = errand_.has_value();
  return std::exchange(errand_, std::nullopt);
}

bool SurveyOrders::take_home() {
  if (!std::exchange(home_, false)) return false;
  goes_home_ = true;
  return true;
}

void SurveyOrders::goes_home(std::string why) {
  goes_home_ = true;
  home_ = scanning_ = on_errand_ = false;
  home_why_ = std::move(why);
}

}  // namespace mission
