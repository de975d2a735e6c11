// Captures that are text: candump, socat, tshark's JSON.
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <chrono>

#include "drivers/text.hpp"
#include "tools/captures_parts.hpp"

namespace captures {
namespace {

using drivers::whole_number;
using drivers::whole_real;

constexpr std::uint32_t kCanErrorFlag = 0x20000000;

// "AABB", or with one of the separators between the pairs.
std::optional<drivers::Bytes> hex_bytes(std::string_view text, std::string_view separators) {
  drivers::Bytes bytes;
  while (!text.empty()) {
    if (separators.find(text[0]) != std::string_view::npos) {
      text.remove_prefix(1);
      continue;
    }
    const int value = drivers::hex_pair(text);
    if (value < 0) return std::nullopt;
    bytes.push_back(static_cast<std::uint8_t>(value));
    text.remove_prefix(2);
  }
  return bytes;
}

// "(1436509052.249713)"
std::optional<double> parenthesized_time(std::string_view word) {
  if (word.size() < 3 || word.front() != '(' || word.back() != ')') return std::nullopt;
  return whole_real(word.substr(1, word.size() - 2));
}

// Three hex digits are a standard id, eight an extended one. Some programs drop leading zeros.
bool take_id(std::string_view digits, Piece& piece) {
  const auto id = whole_number<std::uint32_t>(digits, 16);
  if (!id || digits.size() > 8 || digits[0] == '+') return false;
  piece.can_extended = digits.size() > 3;
  piece.can_id = *id;
  return piece.can_extended || *id <= 0x7FF;
}

struct CanLine {
  Piece piece;
  std::string_view bus;
  std::string_view skip;  // Why the line is understood but no piece.
};

// "123#AABB", "123#R", "123##1AABB"
bool take_compact(std::string_view word, CanLine& line) {
  const auto hash = word.find('#');
  if (!take_id(word.substr(0, hash), line.piece)) return false;
  const auto data = word.substr(hash + 1);
  if (data.starts_with('#')) {
    line.skip = "CAN FD frame";
    return true;
  }
  if (data.starts_with('R')) {
    line.piece.can_remote = true;
    return true;
  }
  auto bytes = hex_bytes(data, ".");
  if (!bytes || bytes->size() > 8) return false;
  line.piece.bytes = std::move(*bytes);
  return true;
}

// "123 [2] AA BB", "123 [0] remote request", "RX - - 123 [2] AA BB"
bool take_columns(std::string_view word, std::string_view rest, CanLine& line) {
  while (word == "RX" || word == "TX" || word == "-" || word == "B" || word == "E")
    word = take_word(rest);
  if (!take_id(word, line.piece)) return false;
  const auto size_word = take_word(rest);
  if (size_word.size() < 3 || size_word.front() != '[' || size_word.back() != ']') return false;
  const auto size = whole_number<unsigned>(size_word.substr(1, size_word.size() - 2));
  if (!size) return false;
  if (*size > 8) line.skip = "CAN FD frame";
  if (rest.find("remote request") != std::string_view::npos) {
    line.piece.can_remote = true;
    return true;
  }
  // After the bytes candump -a shows them as text in quotes.
  auto bytes = hex_bytes(rest.substr(0, rest.find('\'')), " \t");
  if (!bytes || bytes->size() != *size) return false;
  line.piece.bytes = std::move(*bytes);
  return true;
}

std::optional<CanLine> can_line(std::string_view text) {
  CanLine line;
  auto word = take_word(text);
  if (word.starts_with('(')) {
    line.piece.t_s = parenthesized_time(word);
    if (!line.piece.t_s) return std::nullopt;
    word = take_word(text);
  }
  line.bus = word;
  word = take_word(text);
  const bool compact = word.find('#') != std::string_view::npos;
  if (line.bus.empty() || !(compact ? take_compact(word, line) : take_columns(word, text, line)))
    return std::nullopt;
  if (line.piece.can_extended && (line.piece.can_id & kCanErrorFlag) != 0)
    line.skip = "CAN error frame";
  return line;
}

bool is_comment(std::string_view line) {
  const auto at = line.find_first_not_of(" \t\r");
  return at == std::string_view::npos || line[at] == '#';
}

// "< 2026/11/23 09:29:02.000574571  length=8 from=0 to=7"
struct SocatHead {
  bool from_first{};  // '>': from the first address.
  double t_s{};
  std::size_t length{};
};

std::optional<double> socat_time(std::string_view date, std::string_view time) {
  const auto year = whole_number<int>(drivers::take_field(date, '/'));
  const auto month = whole_number<unsigned>(drivers::take_field(date, '/'));
  const auto day = whole_number<unsigned>(date);
  const auto hour = whole_number<unsigned>(drivers::take_field(time, ':'));
  const auto minute = whole_number<unsigned>(drivers::take_field(time, ':'));
  const auto second = whole_real(time);
  if (!year || !month || !day || !hour || !minute || !second) return std::nullopt;
  const std::chrono::year_month_day ymd{std::chrono::year(*year), std::chrono::month(*month),
                                        std::chrono::day(*day)};
  if (!ymd.ok() || *hour > 23 || *minute > 59) return std::nullopt;
  const auto days = std::chrono::sys_days(ymd).time_since_epoch().count();
  return 86400.0 * static_cast<double>(days) + 3600.0 * *hour + 60.0 * *minute + *second;
}

std::optional<SocatHead> socat_head(std::string_view line) {
  const auto side = take_word(line);
  if (side != "<" && side != ">") return std::nullopt;
  const auto date = take_word(line);
  const auto t_s = socat_time(date, take_word(line));
  const auto length = take_word(line);
  if (!t_s || !length.starts_with("length=")) return std::nullopt;
  const auto size = whole_number<std::size_t>(length.substr(7));
  if (!size) return std::nullopt;
  return SocatHead{side == ">", *t_s, *size};
}

// " 01 02 00 00  ....", the text is at column 49 or two blanks after the last byte.
drivers::Bytes socat_bytes(std::string_view line) {
  drivers::Bytes bytes;
  while (line.size() >= 3 && line[0] == ' ' && line[1] != ' ') {
    const int value = drivers::hex_pair(line.substr(1));
    if (value < 0) break;
    bytes.push_back(static_cast<std::uint8_t>(value));
    line.remove_prefix(3);
  }
  return bytes;
}

const boost::json::value* member(const boost::json::value* value, std::string_view key) {
  return value != nullptr && value->is_object() ? value->get_object().if_contains(key) : nullptr;
}

std::optional<double> number_in(const boost::json::value* value) {
  if (value == nullptr || !value->is_string()) return std::nullopt;
  return whole_real(std::string_view(value->get_string()));
}

std::optional<double> json_time(const boost::json::value* layers, const boost::json::value* tcp) {
  if (const auto t = number_in(member(member(tcp, "Timestamps"), "tcp.time_relative"))) return t;
  return number_in(member(member(layers, "frame"), "frame.time_relative"));
}

}  // namespace

bool looks_like_candump(std::string_view file) {
  for (auto rest = file.substr(0, 4096); !rest.empty();) {
    const auto line = take_line(rest);
    if (!is_comment(line)) return can_line(line).has_value();
  }
  return false;
}

Result<Capture> read_candump(std::string_view file, std::string_view file_name, Builder builder) {
  bool any = false;
  int number = 0, first_bad = 0;
  while (!file.empty()) {
    const auto text = take_line(file);
    ++number;
    if (is_comment(text)) continue;
    auto line = can_line(text);
    if (!line || !line->skip.empty()) {
      if (!line && first_bad == 0) first_bad = number;
      builder.skip(line ? line->skip : "line that is no CAN frame", text.size());
      continue;
    }
    any = true;
    line->piece.conversation = builder.conversation(std::string(line->bus));
    builder.add(std::move(line->piece));
  }
  if (!any && first_bad != 0)
    return Error{std::string(file_name), first_bad,
                 "no CAN frame: write \"(t) can0 123#AABB\" or \"can0 123 [2] AA BB\""};
  return builder.take();
}

bool looks_like_socat(std::string_view file) {
  auto rest = file.substr(0, 4096);
  return socat_head(take_line(rest)).has_value();
}

Result<Capture> read_socat(std::string_view file, std::string_view file_name, Builder builder) {
  std::optional<SocatHead> head;
  bool any = false;
  Piece piece;
  const std::size_t conversation = builder.conversation("socat");
  const auto finish = [&] {
    if (!head) return;
    any = true;
    if (piece.bytes.size() != head->length) builder.skip("cut short", piece.bytes.size());
    piece.t_s = head->t_s;
    piece.from_device = head->from_first;
    piece.conversation = conversation;
    builder.add(std::exchange(piece, {}));
    head.reset();
  };
  while (!file.empty()) {
    const auto line = take_line(file);
    if (const auto next = socat_head(line)) {
      finish();
      head = next;
    } else if (line.starts_with("--") || line.empty()) {
      finish();
    } else if (head) {
      auto bytes = socat_bytes(line);
      bytes.resize(
          std::min(bytes.size(), head->length - std::min(piece.bytes.size(), head->length)));
      piece.bytes.insert(piece.bytes.end(), bytes.begin(), bytes.end());
    } else {
      builder.skip("line outside of a block", line.size());
    }
  }
  finish();
  if (!any)
    return Error{std::string(file_name), 1,
                 "no socat dump: blocks begin with \"> YYYY/MM/DD hh:mm:ss.ffffff  length=N\""};
  return builder.take();
}

Result<Capture> read_json(std::string_view file, std::string_view file_name, Builder builder) {
  boost::system::error_code error;
  const auto root = boost::json::parse(file, error);
  if (error || !root.is_array())
    return Error{std::string(file_name), 1,
                 error ? "no JSON: " + error.message() : "no list: give tshark's -T json"};
  for (const auto& packet : root.get_array()) {
    const auto* layers = member(member(&packet, "_source"), "layers");
    const auto* tcp = member(layers, "tcp");
    const auto* payload = member(tcp, "tcp.payload");
    auto bytes = payload != nullptr && payload->is_string()
                     ? hex_bytes(std::string_view(payload->get_string()), ":")
                     : std::nullopt;
    if (!bytes) {
      builder.skip(payload == nullptr ? "packet without TCP payload" : "payload is not hex", 0);
      continue;
    }
    Piece piece;
    piece.t_s = json_time(layers, tcp);
    piece.bytes = std::move(*bytes);
    piece.conversation = builder.conversation("tcp");
    builder.add(std::move(piece));
  }
  return builder.take();
}

}  // namespace captures
