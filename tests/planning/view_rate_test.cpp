#include "planning/view_rate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::RatedView;
using planning::ViewOffer;
using planning::ViewRates;

constexpr double kNoWay = std::numeric_limits<double>::infinity();

struct Offers {
  std::vector<ViewOffer> offers;
  std::vector<double> takes_s;

  std::vector<RatedView> lazily(std::size_t& asked) const {
    std::vector<int> calls(offers.size());
    ViewRates rates(offers, [&](std::size_t i) {
      EXPECT_EQ(++calls[i], 1) << "asked twice";
      return takes_s[i];
    });
    std::vector<RatedView> all;
    if (const auto first = rates.next()) all.push_back(*first);
    asked = rates.asked();
    while (const auto view = rates.next()) all.push_back(*view);
    return all;
  }

  std::vector<RatedView> literally() const {
    std::vector<RatedView> all;
    for (std::size_t i = 0; i < offers.size(); ++i) {
      const double time_s = std::max(takes_s[i], offers[i].least_s);
      if (std::isfinite(time_s))
        all.push_back({i, offers[i].gain_voxels, time_s, 60.0 * offers[i].gain_voxels / time_s});
    }
    std::ranges::stable_sort(all, std::ranges::greater{}, &RatedView::voxels_per_min);
    return all;
  }
};

Offers random_offers(std::uint64_t seed) {
  worlds::Random random(seed);
  Offers made;
  const int n = worlds::uniform_int(random, 0, 200);
  const bool coarse = seed % 3 == 0;  // Many ties.
  for (int i = 0; i < n; ++i) {
    const double scan_s = 300, straight_s = coarse ? 60.0 * worlds::uniform_int(random, 0, 3)
                                                   : worlds::uniform(random, 0, 600);
    const double detour =
        coarse ? worlds::uniform_int(random, 1, 2) : worlds::uniform(random, 1, 2);
    made.offers.push_back(
        {static_cast<std::uint32_t>(worlds::uniform_int(random, 0, coarse ? 3 : 1000)),
         scan_s + straight_s});
    made.takes_s.push_back(worlds::uniform_int(random, 0, 9) == 0 ? kNoWay
                                                                  : scan_s + straight_s * detour);
  }
  return made;
}

TEST(ViewRates, GiveTheOrderOfASortOfAllRealRates) {
  std::size_t asked_sum = 0, offers_sum = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Offers offers = random_offers(seed);
    std::size_t asked = 0;
    ASSERT_EQ(offers.lazily(asked), offers.literally()) << "seed " << seed;
    asked_sum += asked;
    offers_sum += offers.offers.size();
  }
  EXPECT_LT(asked_sum * 4, offers_sum) << "the bound should spare most questions";
}

TEST(ViewRates, PreferANearbyViewOfLessToAFarOneOfMore) {
  ViewRates rates({{500, 300 + 600}, {400, 300 + 60}},
                  [](std::size_t i) { return i == 0 ? 900.0 : 400.0; });
  const auto first = rates.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(*first, (RatedView{1, 400, 400, 60}));
  EXPECT_EQ(rates.asked(), 1U) << "the far one cannot win: it need not be looked into";
}

// Gains are at most what the offers say; 0 where a view is of no use.
TEST(ViewRates, GiveTheOrderOfASortOfAllRealRatesAndGains) {
  std::size_t asked = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Offers most = random_offers(seed);
    Offers real = most;
    worlds::Random random(seed);
    for (ViewOffer& offer : real.offers)
      offer.gain_voxels =
          worlds::uniform_int(random, 0, 9) == 0
              ? 0
              : static_cast<std::uint32_t>(offer.gain_voxels * worlds::uniform(random, 0.5, 1));
    std::vector<int> calls(most.offers.size());
    ViewRates rates(
        most.offers, [&](std::size_t i) { return most.takes_s[i]; },
        [&](std::size_t i) {
          EXPECT_EQ(++calls[i], 1) << "asked twice";
          return real.offers[i].gain_voxels;
        });
    std::vector<RatedView> expected = real.literally();
    std::erase_if(expected, [](const RatedView& view) { return view.gain_voxels == 0; });
    std::vector<RatedView> found;
    while (const auto view = rates.next()) {
      if (found.empty()) asked += static_cast<std::size_t>(std::ranges::count(calls, 1));
      found.push_back(*view);
    }
    ASSERT_EQ(found, expected) << "seed " << seed;
    all += most.offers.size();
  }
  EXPECT_LT(asked * 3, all) << "the bound should spare most questions";
}

TEST(ViewRates, TakeAWayShorterThanTheStraightOneForARoundingError) {
  ViewRates rates({{10, 100}}, [](std::size_t) { return 99.999; });
  EXPECT_EQ(rates.next()->takes_s, 100);
}

TEST(ViewRates, RefuseTimesThatCannotBe) {
  const auto takes = [](std::size_t) { return 1.0; };
  EXPECT_THROW(ViewRates({{1, 0}}, takes), std::invalid_argument);
  EXPECT_THROW(ViewRates({{1, kNoWay}}, takes), std::invalid_argument);
  EXPECT_FALSE(ViewRates({}, takes).next());
}

}  // namespace
