// How a survey heeds what a person orders meanwhile.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hal/together.hpp"
#include "mission/json_text.hpp"
#include "mission/survey.hpp"
#include "planning/tour.hpp"

namespace mission {
namespace {

namespace json = boost::json;

constexpr const char* kSentHome = "sent home by the operator";
constexpr const char* kSkipped = "left out by the operator";

}  // namespace

// Goes to the stop and scans there, as long as nobody wants anything else; then that first. False:
// dropped, with the reason on record, or put off.
hal::Task<bool> Survey::visit(const Stop& stop) {
  for (;;) {
    co_await until_decided();
    co_await obey();
    if (orders_.take_skip()) {
      drop(stop, kSkipped);
      co_return false;
    }
    // The order of the stations was for where the robot was.
    if (orders_.take_moved() && stop.station && stop.task == tasks_.start_area) {
      put_off_ = true;
      co_return false;
    }
    const std::size_t tours_next = tours_next_, scans = record_.scans.size();
    bool done = false;
    const bool over = co_await finished(visit_into(stop, done));
    if (over) co_return done;
    if (record_.scans.size() > scans) co_return true;  // It has the scan, which is being kept.
    tours_next_ = tours_next;
  }
}

hal::Task<void> Survey::visit_into(const Stop& stop, bool& done) {
  if (stop.station || stop.view) {
    done = co_await visit_now(stop);
  } else {
    ScanRecord unused;
    done = co_await drive(stop, unused);
  }
}

// False: an order interrupted it. What it drove until then counts.
hal::Task<bool> Survey::finished(hal::Task<void> step) {
  const double began_s = now_s(), began_m = pilot_.travelled_m();
  orders_.begin_step();
  const int first = co_await hal::first_of(std::move(step), orders_.until_interrupted());
  const bool scanned = orders_.is_scanning();
  orders_.scanning(false);
  if (first == 0) co_return true;
  if (scanned)
    energy_.stood(now_s() - began_s);
  else
    energy_.drove(now_s() - began_s);
  co_await pilot_.abandon();
  record_.driven_total_m += pilot_.travelled_m() - began_m;
  co_return false;
}

// Does what was ordered, until the mission may go on. Throws OrderedHome.
hal::Task<void> Survey::obey() {
  for (;;) {
    note_given();
    if (orders_.take_home()) throw OrderedHome(kSentHome);
    if (const auto errand = orders_.take_errand()) {
      co_await run_errand(*errand);
      orders_.errand_over();
      continue;
    }
    if (!orders_.waits()) co_return;
    co_await wait_for_orders();
  }
}

// The operator may drive the robot meanwhile.
hal::Task<void> Survey::wait_for_orders() {
  const double began_m = pilot_.travelled_m();
  co_await orders_.until_given();
  record_.driven_total_m += pilot_.travelled_m() - began_m;
}

hal::Task<void> Survey::run_errand(const SurveyOrders::Order& errand) {
  const bool scans = errand.kind == SurveyOrders::Kind::scan;
  if (scans && goes_home_for_disk()) {
    tell("no scan is taken any more: the robot goes home for its disk");
    co_return;
  }
  const auto ordered = std::ranges::count_if(record_.scans, [](const ScanRecord& scan) {
    return scan.name.starts_with("ordered ");  // Also before a run was resumed.
  });
  Stop stop{.name = scans ? fmt::format("ordered {}", ordered + 1) : std::string("goto"),
            .task = tasks_.start_area,
            .pose = scans ? pilot_.pose() : errand.goal,
            .station = nullptr,
            .view = nullptr};
  if (!scans && !errand.has_heading) {
    const Eigen::Vector2d way_m = stop.pose.position_m - pilot_.pose().position_m;
    stop.pose.heading_rad = std::atan2(way_m.y(), way_m.x());
  }
  bool done = false;
  const std::size_t dropped = record_.dropped.size();
  const bool over = co_await finished(errand_into(stop, scans, done));
  if (!over)
    tell(fmt::format("{}: interrupted by another order", stop.name));
  else if (!done)
    tell(fmt::format("{}: {}", stop.name,
                     record_.dropped.size() > dropped ? record_.dropped.back().reason : "failed"));
  else
    tell(scans ? fmt::format("{}: scan {} is taken", stop.name, record_.scans.size())
               : fmt::format("{}: there", stop.name));
}

hal::Task<void> Survey::errand_into(const Stop& stop, bool scans, bool& done) {
  ScanRecord scan;
  if (!scans) {
    done = co_await drive(stop, scan);
    co_return;
  }
  scan.name = stop.name;
  scan.area = task(stop.task).area.name;
  scan.planned = stop.pose;
  scan.ground_z_m = task(stop.task).area.ground_z_m;
  orders_.scanning(true);
  done = co_await acquire(stop, std::move(scan));
}

// What was seen so far is closed as at the end of a survey.
hal::Task<void> Survey::leave_for_home() {
  tell("the mission ends here: " + std::string(kSentHome));
  if (record_.scans.empty()) co_return;
  co_await close_tour();
  co_await leave(kSentHome, false);
}

// The stations from number `done` of the tour on, in the order that is shortest from where the
// robot stands; those that no road leads to come last, to be dropped with their reason.
hal::Task<void> Survey::retour(std::size_t t, std::size_t done) {
  AreaPlan& plan = record_.plans[t];
  const auto rest = plan.tour.begin() + static_cast<std::ptrdiff_t>(done);
  const std::vector<int> left(rest, plan.tour.end());
  const std::optional<Eigen::Vector2d> home_m =
      config_.return_home ? std::optional(tasks_.start.position_m) : std::nullopt;
  std::vector<int> order_of_stations;
  const std::function<void()> solve = [&, here_m = Eigen::Vector2d(pilot_.pose().position_m)] {
    order_of_stations = tour_from(here_m, plan, left, roads_[t].roadmap(), home_m);
  };
  co_await parts_.compute.run(solve);
  std::ranges::copy(order_of_stations, rest);
  plan.way_m.clear();  // It was of the old order.
  tours_next_ = done;
  tour_legs_s_.clear();
  json::array order;
  for (auto s = rest; s != plan.tour.end(); ++s) order.emplace_back(station_name(plan, *s));
  decide({{"t_s", now_s()},
          {"decision", "retour"},
          {"from", exact_json(pilot_.pose())},
          {"stations", std::move(order)}});
}

void Survey::note_given() {
  for (const SurveyOrders::Order& order : orders_.take_given()) {
    json::object decision{{"t_s", hal::seconds(order.given_at - began_)},
                          {"decision", "order"},
                          {"order", std::string(name(order.kind))}};
    if (order.kind == SurveyOrders::Kind::go) decision["goal"] = exact_json(order.goal);
    decide(decision);
  }
}

void Survey::tell(const std::string& what) {
  parts_.progress.message(what);
  orders_.tell(what);
}

}  // namespace mission
