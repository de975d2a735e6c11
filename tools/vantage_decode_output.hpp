// How decoded messages are told: to people, as JSON lines, as CSV.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>

#include "drivers/offline.hpp"

namespace decode {

struct Totals {
  std::uint64_t messages{};
  drivers::SkippedBy skipped;
};

class Output {
 public:
  virtual ~Output() = default;
  virtual void message(const drivers::Message& message) = 0;
  virtual void end(const Totals& totals) = 0;
};

enum class Style { human, json, csv };

// Writes to `out`; the end of human and CSV output goes to `err`, so that `out` is only messages.
std::unique_ptr<Output> make_output(Style style, std::FILE* out, std::FILE* err);

}  // namespace decode
