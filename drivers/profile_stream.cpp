#include "drivers/profile_stream.hpp"

#include <algorithm>
#include <cmath>

namespace drivers {
namespace {

constexpr Fault kStuck{1, "same scan again and again", "the scanner's measurement hangs",
                       "switch its power off and on"};
constexpr Fault kSlow{2, "scans too slow", "the mirror does not reach its speed",
                      "wait for the spin-up; if it stays, replace the scanner"};
constexpr Fault kLosing{3, "scans get lost", "the connection or this computer is too slow",
                        "check cable and network load"};
constexpr Fault kLate{4, "scans come late", "something between scanner and computer holds them up",
                      "connect directly; take other traffic off the line"};
constexpr Fault kDisorder{5, "scans out of order", "something on the way holds some messages back",
                          "connect directly, over TCP or a serial line"};

constexpr int kInARow = 10;
constexpr int kCleanAgain = 100;
constexpr double kLate_s = 0.1;
constexpr double kLosingShare = 0.01;

std::string ms(double span_s) {
  return std::to_string(std::lround(span_s * 1000)) + " ms";
}

}  // namespace

void ProfileQueue::put(hal::Profile profile) {
  profiles_.push_back(std::move(profile));
  if (profiles_.size() > most_) {
    const std::uint64_t lost = 1 + profiles_.front().lost_before;
    profiles_.pop_front();
    profiles_.front().lost_before += lost;
    ++dropped_;
  }
  arrived_.notify();
}

hal::Task<hal::Result<hal::Profile>> ProfileQueue::next(hal::Clock& clock, hal::Duration timeout) {
  const hal::Time deadline = clock.now() + timeout;
  while (profiles_.empty()) {
    const bool some = co_await arrived_.wait_until(clock, deadline);
    if (!some) co_return make_error_code(boost::system::errc::timed_out);
  }
  hal::Profile profile = std::move(profiles_.front());
  profiles_.pop_front();
  co_return profile;
}

void ScanWatch::in_a_row(bool bad, int& count, const Fault& fault, const std::string& detail) {
  count = bad ? count + 1 : 0;
  if (count == kInARow) troubles_.set(fault, detail);
  if (count == 0) troubles_.clear(fault);
}

void ScanWatch::repeated(const std::string& which) {
  ++repetitions_;
  if (++stuck_ == kInARow)
    troubles_.set(kStuck, which + " came again " + std::to_string(stuck_) + " times");
}

void ScanWatch::out_of_order() {
  ++disorders_;
  in_order_ = 0;
  troubles_.set(kDisorder, std::to_string(disorders_) + " so far");
}

void ScanWatch::came(double step_s, double period_s, double late_s, std::uint64_t lost) {
  stuck_ = 0;
  troubles_.clear(kStuck);
  if (++in_order_ == kCleanAgain) troubles_.clear(kDisorder);
  const bool slow = step_s > 1.2 * period_s && lost == 0;
  if (step_s > 0 && (slow || slow_ > 0))
    in_a_row(slow, slow_, kSlow, "one every " + ms(step_s) + " instead of " + ms(period_s));
  if (late_s > kLate_s || late_ > 0) in_a_row(late_s > kLate_s, late_, kLate, "by " + ms(late_s));
  jitter_s_ = std::max(jitter_s_ * 0.98, late_s);
  lost_share_ += (static_cast<double>(lost) / static_cast<double>(lost + 1) - lost_share_) / 100;
  if (lost_share_ > kLosingShare)
    troubles_.set(kLosing, std::to_string(std::lround(lost_share_ * 1000)) + " of 1000");
  else if (lost_share_ < kLosingShare / 2)
    troubles_.clear(kLosing);
}

}  // namespace drivers
