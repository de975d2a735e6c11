// What a Modbus client promises, against a unit whose tables are known.
#pragma once

#include "sim/register_unit.hpp"
#include "sim/unit_faults.hpp"
#include "tests/links/promises/promises.hpp"

namespace links_test {

// A unit with kSize of everything. Input registers are 1000 + i, discrete inputs are on where 3
// divides i; the rest begins as 0. Address kSize and beyond do not exist.
class TableUnit final : public sim::RegisterUnit {
 public:
  static constexpr std::size_t kSize = 200;

  explicit TableUnit(hal::Clock& clock) : faults_(clock) {}

  hal::Result<std::vector<std::uint16_t>> read_input(hal::RegisterRange range) override;
  hal::Result<std::vector<std::uint16_t>> read_holding(hal::RegisterRange range) override;
  hal::Result<std::vector<bool>> read_coils(hal::RegisterRange range) override;
  hal::Result<std::vector<bool>> read_discrete(hal::RegisterRange range) override;
  hal::Result<void> write_register(std::uint16_t at, std::uint16_t value) override;
  hal::Result<void> write_coil_raw(std::uint16_t at, std::uint16_t value) override;
  sim::UnitFaults* faults() override { return &faults_; }

 private:
  sim::UnitFaults faults_;
  std::vector<std::uint16_t> holding_ = std::vector<std::uint16_t>(kSize);
  std::vector<std::uint16_t> coils_ = std::vector<std::uint16_t>(kSize);  // As they were written.
};

struct RegisterRig {
  virtual ~RegisterRig() = default;
  virtual Loop& loop() = 0;
  virtual hal::Registers& client() = 0;
  // The unit does not answer any more, or does again. False: cannot.
  virtual bool silence(bool) { return false; }
  virtual bool cut() { return false; }
  virtual void mend() {}
  // What a client is told on a cut line: there is no connection that could be lost on a serial one.
  virtual bool has_connection() const { return true; }
  // Coils that take other values than on and off.
  virtual bool has_raw_coils() const { return true; }
};

std::span<const Promise<RegisterRig>> register_promises();

}  // namespace links_test
