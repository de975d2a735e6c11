// NTRIP, versions 1 and 2: how a caster is asked for corrections, and what it answers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/bytes.hpp"

namespace drivers {

enum class NtripVersion : std::uint8_t { v1 = 1, v2 = 2 };

struct NtripRequest {
  std::string host;  // As version 2 must name it.
  std::uint16_t port = 2101;
  std::string mountpoint;
  std::string user, password;  // Empty user: none are sent.
  NtripVersion version = NtripVersion::v2;
};

// Empty, or why nobody can be asked so; never with the password in it.
std::string ntrip_request_problem(const NtripRequest& request);
// `gga`: a sentence with where we are, for version 2; empty: none.
std::string ntrip_request(const NtripRequest& request, std::string_view gga = {});

// The end of a request that a caster got, and what it says; for simulated casters.
struct NtripAsked {
  std::string mountpoint, user, password, gga;
  NtripVersion version{};
  std::size_t size{};  // Of the whole request.
};
// Nothing while the request is not whole, or is none.
std::optional<NtripAsked> parse_ntrip_request(std::string_view text);

// An entry of a caster's table of sources.
struct NtripSource {
  std::string mountpoint, format;
  bool wants_position{};  // It sends nothing before it was told where we are.
};
std::optional<NtripSource> ntrip_source(std::string_view line);

enum class NtripVerdict {
  pending,       // Its answer is not whole yet.
  stream,        // What comes from now on are corrections.
  source_table,  // In place of a mountpoint that it does not have.
  unauthorised,
  not_found,
  refused,  // For another reason: see status().
  foreign   // No caster answers so.
};

// One answer, fed as it comes. Holds at most kHeadMax bytes.
class NtripAnswer {
 public:
  static constexpr std::size_t kHeadMax = 8192;

  void feed(ByteView bytes);

  NtripVerdict verdict() const { return verdict_; }
  const std::string& status() const { return status_; }  // Its first line, at most 120 characters.
  // What of the last feed() belongs to the stream or the table.
  ByteView body() const { return body_; }
  bool broken() const { return broken_; }  // The chunks are out of step: nothing can be read on.
  bool ended() const { return ended_; }    // It said that no more will come.

 private:
  enum class Chunk { size, data, data_end };

  void read_head();
  void judge(std::string_view head);
  void judge_http(std::string_view head);
  void take(ByteView bytes);
  void take_chunks(ByteView bytes);
  void end_size_line();
  ByteView without_icy_lines(ByteView bytes);

  NtripVerdict verdict_{};
  std::string head_, status_;
  Bytes body_;
  bool icy_lines_{}, icy_in_line_{};
  bool chunked_{}, broken_{}, ended_{};
  Chunk chunk_{};
  std::string size_line_;
  std::size_t chunk_left_{};
};

std::string base64(std::string_view text);

}  // namespace drivers
