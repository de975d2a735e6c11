#include "tests/links/promises/register_promises.hpp"

#include "drivers/modbus_errors.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;

bool exists(hal::RegisterRange range) {
  return std::size_t{range.first} + range.count <= TableUnit::kSize;
}

boost::system::error_code no_such_address() {
  return drivers::modbus::error_of(2);
}

}  // namespace

hal::Result<std::vector<std::uint16_t>> TableUnit::read_input(hal::RegisterRange range) {
  if (!exists(range)) return no_such_address();
  std::vector<std::uint16_t> values;
  for (std::uint16_t i = 0; i < range.count; ++i)
    values.push_back(static_cast<std::uint16_t>(1000 + range.first + i));
  return values;
}
hal::Result<std::vector<std::uint16_t>> TableUnit::read_holding(hal::RegisterRange range) {
  if (!exists(range)) return no_such_address();
  return std::vector<std::uint16_t>(holding_.begin() + range.first,
                                    holding_.begin() + range.first + range.count);
}
hal::Result<std::vector<bool>> TableUnit::read_coils(hal::RegisterRange range) {
  if (!exists(range)) return no_such_address();
  std::vector<bool> bits;
  for (std::uint16_t i = 0; i < range.count; ++i)
    bits.push_back(coils_[static_cast<std::size_t>(range.first) + i] != 0);
  return bits;
}
hal::Result<std::vector<bool>> TableUnit::read_discrete(hal::RegisterRange range) {
  if (!exists(range)) return no_such_address();
  std::vector<bool> bits;
  for (std::uint16_t i = 0; i < range.count; ++i) bits.push_back((range.first + i) % 3 == 0);
  return bits;
}
hal::Result<void> TableUnit::write_register(std::uint16_t at, std::uint16_t value) {
  if (at >= kSize) return no_such_address();
  holding_[at] = value;
  return {};
}
hal::Result<void> TableUnit::write_coil_raw(std::uint16_t at, std::uint16_t value) {
  if (at >= kSize) return no_such_address();
  coils_[at] = value;
  return {};
}

namespace {

// As a unit gives them.
template <class... Values>
std::vector<std::uint16_t> words(Values... values) {
  return {static_cast<std::uint16_t>(values)...};
}
template <class... Values>
std::vector<bool> bits(Values... values) {
  return {values...};
}

hal::Task<void> reading(hal::Registers& unit) {
  const auto input = co_await unit.read_input({5, 100});
  require_success(input, "read input registers");
  require(input->size() == 100 && input->front() == 1005 && input->back() == 1104,
          "input registers differ");
  const auto discrete = co_await unit.read_discrete({1, 19});
  require_success(discrete, "read discrete inputs");
  require(discrete->size() == 19, "another number of bits");
  for (std::size_t i = 0; i < 19; ++i)
    require((*discrete)[i] == ((i + 1) % 3 == 0), "discrete input " + std::to_string(i + 1));
}

// Until it answers.
hal::Task<void> up(RegisterRig& rig) {
  const hal::Time late = rig.loop().clock().now() + 20s;
  for (;;) {
    const auto values = co_await rig.client().read_input({0, 1});
    if (values) co_return;
    require(rig.loop().clock().now() < late, "the unit does not answer within 20 s");
    co_await rig.loop().clock().sleep_for(50ms);
  }
}

hal::Task<void> tables_are_read_as_they_are(RegisterRig& rig) {
  co_await up(rig);
  co_await reading(rig.client());
}

hal::Task<void> what_is_written_is_read_back(RegisterRig& rig) {
  co_await up(rig);
  auto& unit = rig.client();
  require_success(co_await unit.write_register(7, 0xBEEF), "write a register");
  require_success(co_await unit.write_coil(9, true), "switch a coil on");
  const auto holding = co_await unit.read_holding({6, 3});
  require_success(holding, "read holding registers");
  require(*holding == words(0, 0xBEEF, 0), "holding registers differ");
  const auto coils = co_await unit.read_coils({8, 3});
  require_success(coils, "read coils");
  require(*coils == bits(false, true, false), "coils differ");
  require_success(co_await unit.write_coil(9, false), "switch a coil off");
  require(co_await unit.read_coils({9, 1}) == bits(false), "the coil stays on");
}

hal::Task<void> coils_take_any_value(RegisterRig& rig) {
  co_await up(rig);
  if (!rig.has_raw_coils()) throw Skipped("coils of this unit are on or off");
  require_success(co_await rig.client().write_coil_raw(11, 0x5500), "write 0x5500");
  require_success(co_await rig.client().write_coil_raw(12, 7), "write 7");
  require(co_await rig.client().read_coils({11, 2}) == bits(true, true), "they did not arrive");
}

hal::Task<void> refusals_are_told_and_do_not_disturb(RegisterRig& rig) {
  co_await up(rig);
  auto& unit = rig.client();
  constexpr std::uint16_t kBeyond = TableUnit::kSize;
  for (int i = 0; i < 3; ++i) {
    require_error(co_await unit.read_input({kBeyond, 1}), errc::bad_address, "read beyond");
    require_error(co_await unit.read_coils({kBeyond - 1, 2}), errc::bad_address, "cross the end");
    require_error(co_await unit.write_register(kBeyond, 1), errc::bad_address, "write beyond");
    require_error(co_await unit.write_coil(kBeyond, true), errc::bad_address, "switch beyond");
    co_await reading(unit);
  }
}

hal::Task<void> impossible_counts_are_refused_here(RegisterRig& rig) {
  co_await up(rig);
  auto& unit = rig.client();
  require_error(co_await unit.read_input({0, 0}), errc::invalid_argument, "read nothing");
  require_error(co_await unit.read_input({0, 126}), errc::invalid_argument, "126 registers");
  require_error(co_await unit.read_discrete({0, 2001}), errc::invalid_argument, "2001 bits");
  co_await reading(unit);
}

hal::Task<void> several_may_ask_at_once(RegisterRig& rig) {
  co_await up(rig);
  const auto ask = [&](std::uint16_t first) -> hal::Task<void> {
    for (std::uint16_t i = 0; i < 10; ++i) {
      const auto values = co_await rig.client().read_input({first, 2});
      require_success(values, "read");
      require(*values == words(1000 + first, 1001 + first), "the reply to another's request");
    }
  };
  co_await within(rig.loop(), 30s, "40 requests", (ask(1) && ask(20) && ask(40) && ask(60)));
}

void demand_silence(RegisterRig& rig, bool on) {
  if (!rig.silence(on)) throw Skipped("the unit cannot be silenced here");
}

hal::Task<void> a_silent_unit_is_told_in_time(RegisterRig& rig) {
  co_await up(rig);
  demand_silence(rig, true);
  for (int i = 0; i < 2; ++i) {
    const hal::Time asked = rig.loop().clock().now();
    require_error(co_await rig.client().read_input({0, 1}), errc::timed_out, "a silent unit");
    require(rig.loop().clock().now() - asked < 2s, "told after more than 2 s");
  }
  demand_silence(rig, false);
  co_await up(rig);
  co_await reading(rig.client());
}

hal::Task<void> a_cancelled_request_disturbs_nobody(RegisterRig& rig) {
  co_await up(rig);
  for (int i = 0; i < 5; ++i) {
    co_await patiently(rig.loop(), 0ms, rig.client().read_input({17, 3}));
    co_await reading(rig.client());
  }
}

void demand_cut(RegisterRig& rig) {
  if (!rig.cut()) throw Skipped("cannot be cut here");
}

hal::Task<void> a_lost_connection_is_told_and_comes_back(RegisterRig& rig) {
  co_await up(rig);
  demand_cut(rig);
  for (int i = 0; i < 3; ++i) {
    const auto lost = co_await rig.client().read_input({0, 1});
    require(lost.has_error(), "a cut line answers");
    require(lost.error() == errc::not_connected || !rig.has_connection(),
            "a cut line: " + lost.error().message());
  }
  rig.mend();
  co_await up(rig);
  co_await reading(rig.client());
}

hal::Task<void> a_dialogue_survives_a_cut_at_any_call(RegisterRig& rig) {
  for (std::uint16_t fails = 0; fails < 4; ++fails) {
    co_await up(rig);
    for (std::uint16_t i = 0; i < 4; ++i) {
      if (i == fails) {
        demand_cut(rig);
        require((co_await rig.client().write_register(i, 1)).has_error(), "a cut line answers");
        rig.mend();
        co_await up(rig);
      }
      require_success(co_await rig.client().write_register(i, fails), "write");
      require(co_await rig.client().read_holding({i, 1}) == words(fails), "what was written");
    }
  }
}

hal::Task<void> waiting_costs_nothing(RegisterRig& rig) {
  co_await up(rig);
  co_await rest(rig.loop(), "an idle client");
}

constexpr Promise<RegisterRig> kRegisterPromises[] = {
    {"TablesAreReadAsTheyAre", tables_are_read_as_they_are},
    {"WhatIsWrittenIsReadBack", what_is_written_is_read_back},
    {"CoilsTakeAnyValue", coils_take_any_value},
    {"RefusalsAreToldAndDoNotDisturb", refusals_are_told_and_do_not_disturb},
    {"ImpossibleCountsAreRefusedHere", impossible_counts_are_refused_here},
    {"SeveralMayAskAtOnce", several_may_ask_at_once},
    {"ASilentUnitIsToldInTime", a_silent_unit_is_told_in_time},
    {"ACancelledRequestDisturbsNobody", a_cancelled_request_disturbs_nobody},
    {"ALostConnectionIsToldAndComesBack", a_lost_connection_is_told_and_comes_back},
    {"ADialogueSurvivesACutAtAnyCall", a_dialogue_survives_a_cut_at_any_call},
    {"WaitingCostsNothing", waiting_costs_nothing},
};

}  // namespace

std::span<const Promise<RegisterRig>> register_promises() {
  return kRegisterPromises;
}

}  // namespace links_test
