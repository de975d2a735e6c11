// What the simulated wires share: when a message arrives, and what the faults make of it.
#pragma once

#include <algorithm>
#include <boost/system/errc.hpp>
#include <span>

#include "sim/link_faults.hpp"

namespace sim {

inline boost::system::error_code error(boost::system::errc::errc_t code) {
  return boost::system::errc::make_error_code(code);
}

class Disturbance {
 public:
  explicit Disturbance(std::uint64_t seed) : dice_(seed) {}

  void set(const LinkFaults& faults) { faults_ = faults; }
  const LinkFaults& faults() const { return faults_; }
  Dice& dice() { return dice_; }

  // When a message that leaves at `leaves` arrives.
  hal::Time arrival(hal::Time leaves) {
    const auto jitter = static_cast<std::uint64_t>(faults_.jitter.count());
    const hal::Duration late = faults_.delay + hal::Duration(dice_.below(jitter));
    if (dice_.hit(faults_.reordering)) return leaves + late + LinkFaults::kHeldBack;
    last_arrival_ = std::max(last_arrival_, leaves + late);
    return last_arrival_;
  }
  bool loses() { return dice_.hit(faults_.loss); }
  bool doubles() { return dice_.hit(faults_.duplication); }
  bool corrupts() { return dice_.hit(faults_.corruption); }

  // Flips one bit of one byte.
  void corrupt(std::span<std::uint8_t> bytes) {
    if (bytes.empty()) return;
    auto& byte = bytes[dice_.below(bytes.size())];
    byte = static_cast<std::uint8_t>(byte ^ 1U << dice_.below(8));
  }

  // Takes up to `amount` from what may pass before the cut: how much still passes.
  std::uint64_t pass(std::uint64_t amount) {
    if (!faults_.cut_after) return amount;
    const std::uint64_t passes = std::min(amount, *faults_.cut_after);
    *faults_.cut_after -= passes;
    return passes;
  }
  bool cut_now() const { return faults_.cut_after == std::uint64_t{0}; }
  void mended() {
    if (cut_now()) faults_.cut_after.reset();
  }

 private:
  Dice dice_;
  LinkFaults faults_;
  hal::Time last_arrival_{};
};

}  // namespace sim
