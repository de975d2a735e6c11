#include "mission/view_times.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/survey_site.hpp"

namespace mission {
namespace {

NextView view_at(double x_m, double y_m, std::uint32_t voxels, int task = 0) {
  NextView view;
  view.cell.task = task;
  view.pose.position_m = {x_m, y_m};
  view.voxels = voxels;
  return view;
}

// A yard cut in two by a wall with a gap at its far end; beside it an area for a person.
struct Yard {
  support::SurveySite site{60, {{{29, 0, 0}, {31, 54, 4}}}};
  nav::Roadmap roads;

  Yard() : roads(nav::Roadmap::build(site.tasks.tasks[0].area, 0.5)) {
    nav::FreeArea beside;
    beside.name = "beside";
    site.tasks.tasks.push_back({beside, AreaMode::manual});
    site.tasks.tasks.push_back({beside, AreaMode::robot});
    site.config.robot.scanner.scan_s = 60;
    site.config.robot.sim.placement_s = 30;
    site.config.robot.body.speed_max_mps = 0.5;
  }
  ViewTimes times(const Eigen::Vector2d& robot_m = {20, 10}) const {
    return {site.config, site.tasks, &roads, robot_m};
  }
};

TEST(ViewTimes, CountTheRoadNotTheStraightLineAndTheScan) {
  const Yard yard;
  const NextView near = view_at(10, 10, 1), behind = view_at(40, 10, 1);
  EXPECT_NEAR(yard.times().takes_s(near), 10 / 0.5 + 60, 1);
  EXPECT_NEAR(yard.times().least_s(behind), 20 / 0.5 + 60, 1e-9);
  EXPECT_GT(yard.times().takes_s(behind), (2 * 44) / 0.5 + 60) << "round the wall";
}

TEST(ViewTimes, CountSettingUpWhereAPersonCarriesTheScanner) {
  const Yard yard;
  const NextView by_hand = view_at(1000, 1000, 1, 1);
  EXPECT_EQ(yard.times().takes_s(by_hand), 90);
  EXPECT_EQ(yard.times().least_s(by_hand), 90);
}

TEST(ViewTimes, AreInfiniteWhereNoRoadLeads) {
  const Yard yard;
  EXPECT_TRUE(std::isinf(yard.times().takes_s(view_at(30, 20, 1)))) << "in the wall";
  EXPECT_TRUE(std::isinf(yard.times().takes_s(view_at(10, 10, 1, 2)))) << "another area";
  const ViewTimes nowhere(yard.site.config, yard.site.tasks, nullptr, {0, 0});
  EXPECT_TRUE(std::isinf(nowhere.takes_s(view_at(10, 10, 1))));
}

TEST(ShortestTrip, IsTheShortestOfAllOrdersAndLeavesWhatHasNoRoadForLast) {
  const Yard yard;
  const Eigen::Vector2d robot_m(20, 10);
  const std::vector<ViewPlace> places{{0, {40, 10}}, {1, {5, 5}},   {0, {10, 50}},
                                      {0, {30, 20}}, {0, {24, 50}}, {0, {50, 50}}};
  const ViewTrip trip = shortest_trip(places, 0, &yard.roads, robot_m);
  ASSERT_EQ(trip.by_road, 4U);
  std::vector<std::size_t> order{0, 2, 4, 5};
  double least_m = 1e9;
  do {
    double sum_m = 0;
    Eigen::Vector2d at_m = robot_m;
    for (const std::size_t i : order) {
      sum_m += yard.roads.route(at_m, places[i].at_m)->length_m;
      at_m = places[i].at_m;
    }
    least_m = std::min(least_m, sum_m);
  } while (std::ranges::next_permutation(order).found);
  EXPECT_NEAR(trip.road_m, least_m, 1e-6);
  EXPECT_EQ(trip.order.size(), places.size());
  EXPECT_EQ(trip.order[4], 1U) << "carried there";
  EXPECT_EQ(trip.order[5], 3U) << "in the wall";
  const ViewTrip no_roads = shortest_trip(places, 0, nullptr, robot_m);
  EXPECT_EQ(no_roads.by_road, 0U);
  EXPECT_EQ(no_roads.order, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
}

TEST(Choose, TakesTheMostVoxelsOrTheMostPerMinute) {
  const Yard yard;
  std::vector<NextView> views{view_at(40, 10, 300), view_at(10, 10, 200)};
  const auto by_gain = choose(views, yard.times(), false);
  ASSERT_TRUE(by_gain);
  EXPECT_EQ(by_gain->view, 0U);
  const auto by_rate = choose(views, yard.times(), true);
  ASSERT_TRUE(by_rate);
  EXPECT_EQ(by_rate->view, 1U);
  EXPECT_NEAR(*by_rate->voxels_per_min, 200 / *by_rate->takes_min, 1e-9);
}

TEST(Choose, EqualsRatingEveryViewByItsRoad) {
  const Yard yard;
  support::Dice dice(3);
  for (int round = 0; round < 20; ++round) {
    std::vector<NextView> views;
    for (int i = 0; i < 40; ++i)
      views.push_back(view_at(dice.uniform(0, 60), dice.uniform(0, 60),
                              static_cast<std::uint32_t>(100 + dice.below(200)), i % 10 == 0));
    const ViewTimes times = yard.times({dice.uniform(2, 28), dice.uniform(2, 58)});
    std::size_t best = views.size();
    double best_rate = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double rate = 60.0 * views[i].voxels / times.takes_s(views[i]);
      if (rate > best_rate) {
        best = i;
        best_rate = rate;
      }
    }
    const auto chosen = choose(views, times, true);
    ASSERT_TRUE(chosen);
    EXPECT_EQ(chosen->view, best);
    EXPECT_EQ(chosen->voxels_per_min, best_rate);
  }
}

TEST(Choose, TakesTheBestByGainEvenIfNoRoadIsKnownAndNothingByRateIfNoneIs) {
  const Yard yard;
  std::vector<NextView> views{view_at(30, 20, 300)}, none;
  const auto by_gain = choose(views, yard.times(), false);
  ASSERT_TRUE(by_gain);
  EXPECT_FALSE(by_gain->takes_min) << "the drive will tell why";
  EXPECT_FALSE(choose(views, yard.times(), true));
  EXPECT_FALSE(choose(none, yard.times(), false));
}

// A scanner that does not see all around: what a view sees is known once it is faced.
TEST(Choose, EqualsFacingEveryViewAndFacesFew) {
  const Yard yard;
  support::Dice dice(4);
  std::size_t faced = 0, all = 0;
  for (int round = 0; round < 20; ++round) {
    std::vector<NextView> views;
    std::map<double, std::uint32_t> sees;  // By x.
    for (int i = 0; i < 60; ++i) {
      const auto around = static_cast<std::uint32_t>(100 + dice.below(200));
      views.push_back(view_at(dice.uniform(0, 60), dice.uniform(0, 60), around));
      views.back().faced = false;
      sees[views.back().pose.position_m.x()] =
          static_cast<std::uint32_t>(around * dice.uniform(0.4, 1));
    }
    std::ranges::stable_sort(views, std::ranges::greater{}, &NextView::voxels);
    const ViewTimes times = yard.times({dice.uniform(2, 28), dice.uniform(2, 58)});
    constexpr std::uint32_t kGainMin = 120;
    std::size_t best = views.size();
    double best_rate = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::uint32_t voxels = sees.at(views[i].pose.position_m.x());
      const double rate = 60.0 * voxels / times.takes_s(views[i]);
      if (voxels < kGainMin || rate <= best_rate) continue;
      best = i;
      best_rate = rate;
    }
    const FaceView face = [&](NextView& view) {
      ASSERT_FALSE(view.faced) << "once is enough";
      view.faced = true;
      view.voxels = sees.at(view.pose.position_m.x());
    };
    const auto chosen = choose(views, times, true, face, kGainMin);
    ASSERT_TRUE(chosen);
    EXPECT_EQ(chosen->view, best);
    EXPECT_EQ(chosen->voxels_per_min, best_rate);
    EXPECT_TRUE(views[best].faced);
    faced += static_cast<std::size_t>(std::ranges::count_if(views, &NextView::faced));
    all += views.size();
    // Asked again without the best, it goes on from there.
    views.erase(views.begin() + static_cast<std::ptrdiff_t>(best));
    EXPECT_TRUE(choose(views, times, true, face, kGainMin));
  }
  EXPECT_LT(faced * 3, all);
}

TEST(Choose, TakesNoViewByGainThatIsNotFaced) {
  const Yard yard;
  std::vector<NextView> views{view_at(10, 10, 300)};
  views.front().faced = false;
  EXPECT_FALSE(choose(views, yard.times(), false));
}

}  // namespace
}  // namespace mission
