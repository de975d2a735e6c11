#include "drivers/ntrip_codec.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "drivers/text.hpp"

namespace drivers {
namespace {

constexpr std::string_view kEnd = "\r\n";
constexpr std::string_view kAgent = "NTRIP Vantage/1.0";
constexpr std::size_t kStatusMax = 120;
constexpr std::size_t kFirstLineMax = 1024;
constexpr std::size_t kChunkMax = 1U << 24;
constexpr std::size_t kSizeLineMax = 64;
constexpr std::size_t kSourceFields = 12;  // Up to the one that says whether it wants a position.
constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

bool printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > 0x20 && c < 0x7F; });
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

// The value of a header line, in lower case where `as_sent` does not say otherwise.
std::string header(std::string_view head, std::string_view name, bool as_sent = false) {
  take_field(head, '\n');
  while (!head.empty()) {
    const std::string_view line = take_field(head, '\n');
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || lower(trimmed(line.substr(0, colon))) != name) continue;
    const std::string_view value = trimmed(line.substr(colon + 1));
    return as_sent ? std::string(value) : lower(value);
  }
  return {};
}

std::optional<std::string> from_base64(std::string_view text) {
  std::string result;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const auto at = std::string_view(kLetters).find(c);
    if (at == std::string_view::npos) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(at);
    if ((count += 6) < 8) continue;
    count -= 8;
    result += static_cast<char>(bits >> count & 0xFFU);
  }
  return result;
}

NtripVerdict verdict_of(std::string_view reason) {
  const std::string said = lower(reason);
  for (const char* word : {"password", "unauthor", "forbidden", "credential"})
    if (said.find(word) != std::string::npos) return NtripVerdict::unauthorised;
  const bool mount = said.find("mount") != std::string::npos;
  return mount ? NtripVerdict::not_found : NtripVerdict::refused;
}

}  // namespace

std::string base64(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at < text.size(); at += 3) {
    const std::string_view three = text.substr(at, 3);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < 3; ++i)
      bits = bits << 8 | (i < three.size() ? static_cast<std::uint8_t>(three[i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i)
      result += i <= three.size() ? kLetters[bits >> (18 - 6 * i) & 63U] : '=';
  }
  return result;
}

std::string ntrip_request_problem(const NtripRequest& r) {
  if (r.mountpoint.empty()) return "no mountpoint is named";
  if (!printable(r.mountpoint) || r.mountpoint.find('/') != std::string::npos)
    return "a mountpoint has no blanks, slashes or control characters";
  if (r.host.empty() || !printable(r.host)) return "no host is named";
  if (r.user.find(':') != std::string::npos) return "a user's name has no colon";
  const auto breaks = [](const std::string& text) {
    return std::any_of(text.begin(), text.end(), [](char c) { return c == '\r' || c == '\n'; });
  };
  if (breaks(r.user) || breaks(r.password)) return "user and password are one line";
  return {};
}

std::string ntrip_request(const NtripRequest& r, std::string_view gga) {
  const bool second = r.version == NtripVersion::v2;
  std::string text = "GET /" + r.mountpoint + (second ? " HTTP/1.1\r\n" : " HTTP/1.0\r\n");
  const auto add = [&](std::string_view name, std::string_view value) {
    text.append(name).append(": ").append(value).append(kEnd);
  };
  if (second) {
    add("Host", r.host + ":" + std::to_string(r.port));
    add("Ntrip-Version", "Ntrip/2.0");
  }
  add("User-Agent", kAgent);
  if (!r.user.empty()) add("Authorization", "Basic " + base64(r.user + ":" + r.password));
  if (second && !gga.empty()) add("Ntrip-GGA", trimmed(gga.substr(0, gga.find('\n'))));
  if (second) add("Connection", "close");
  return text.append(kEnd);
}

std::optional<NtripAsked> parse_ntrip_request(std::string_view text) {
  const auto end = text.find("\r\n\r\n");
  if (end == std::string_view::npos || !text.starts_with("GET /")) return std::nullopt;
  const std::string_view head = text.substr(0, end + 2);
  std::string_view line = head.substr(5, head.find('\r') - 5);
  NtripAsked asked;
  asked.mountpoint = take_field(line, ' ');
  asked.version =
      header(head, "ntrip-version") == "ntrip/2.0" ? NtripVersion::v2 : NtripVersion::v1;
  asked.gga = header(head, "ntrip-gga", true);
  std::string_view authorization;
  const std::string value = header(head, "authorization", true);
  authorization = value;
  if (lower(take_field(authorization, ' ')) == "basic")
    if (const auto both = from_base64(trimmed(authorization))) {
      std::string_view rest = *both;
      asked.user = take_field(rest, ':');
      asked.password = rest;
    }
  asked.size = end + 4;
  return asked;
}

std::optional<NtripSource> ntrip_source(std::string_view line) {
  line = trimmed(line);
  if (take_field(line, ';') != "STR") return std::nullopt;
  NtripSource source;
  for (std::size_t field = 1; field < kSourceFields; ++field) {
    const std::string_view value = take_field(line, ';');
    if (field == 1) source.mountpoint = value;
    if (field == 3) source.format = value;
    if (field == 11) source.wants_position = value == "1";
  }
  return source.mountpoint.empty() ? std::nullopt : std::optional(source);
}

void NtripAnswer::feed(ByteView bytes) {
  body_.clear();
  if (verdict_ != NtripVerdict::pending) return take(bytes);
  head_ += as_text(bytes);
  read_head();
}

// The first line says how the rest is to be read.
void NtripAnswer::read_head() {
  const auto line_end = head_.find('\n');
  if (line_end == std::string::npos) {
    if (head_.size() > kFirstLineMax) judge(head_);
    return;
  }
  std::size_t size = line_end + 1;
  if (head_.starts_with("HTTP/")) {
    const auto whole = head_.find("\r\n\r\n");
    if (whole == std::string::npos && head_.size() < kHeadMax) return;
    size = whole == std::string::npos ? head_.size() : whole + 4;
  }
  const std::string rest = head_.substr(size);
  head_.resize(size);
  judge(head_);
  head_.clear();
  take(as_bytes(rest));
}

void NtripAnswer::judge(std::string_view head) {
  status_ = trimmed(head.substr(0, std::min(head.find('\n'), kStatusMax)));
  for (char& c : status_)
    if (c < 0x20 || c > 0x7E) c = '?';
  if (status_.starts_with("ICY 200")) {
    verdict_ = NtripVerdict::stream;
    icy_lines_ = true;
  } else if (status_.starts_with("SOURCETABLE 200")) {
    verdict_ = NtripVerdict::source_table;
  } else if (status_.starts_with("HTTP/1.")) {
    judge_http(head);
  } else if (status_.starts_with("ERROR") || status_.starts_with("ICY ")) {
    verdict_ = verdict_of(status_);
  } else {
    verdict_ = NtripVerdict::foreign;
  }
}

void NtripAnswer::judge_http(std::string_view head) {
  std::string_view line = status_;
  take_field(line, ' ');
  const auto code = whole_number<int>(take_field(line, ' ')).value_or(0);
  chunked_ = header(head, "transfer-encoding").find("chunked") != std::string::npos;
  const std::string type = header(head, "content-type");
  if (code == 401 || code == 403)
    verdict_ = NtripVerdict::unauthorised;
  else if (code == 404)
    verdict_ = NtripVerdict::not_found;
  else if (code != 200)
    verdict_ = code == 0 ? NtripVerdict::foreign : NtripVerdict::refused;
  else if (type.find("sourcetable") != std::string::npos)
    verdict_ = NtripVerdict::source_table;
  else
    verdict_ = type.starts_with("text/html") ? NtripVerdict::foreign : NtripVerdict::stream;
}

// Some casters send header lines after "ICY 200 OK", some an empty line, some neither.
ByteView NtripAnswer::without_icy_lines(ByteView bytes) {
  std::size_t at = 0;
  while (icy_lines_ && at < bytes.size()) {
    const std::uint8_t c = bytes[at];
    if (c == '\n')
      icy_lines_ = std::exchange(icy_in_line_, false);
    else if (c >= 0x20 && c <= 0x7E)
      icy_in_line_ = true;
    else if (c != '\r')
      icy_lines_ = false;
    if (icy_lines_ || c == '\n') ++at;
  }
  return bytes.subspan(at);
}

void NtripAnswer::take(ByteView bytes) {
  if (icy_lines_) bytes = without_icy_lines(bytes);
  if (chunked_) return take_chunks(bytes);
  body_.insert(body_.end(), bytes.begin(), bytes.end());
}

void NtripAnswer::take_chunks(ByteView bytes) {
  while (!bytes.empty() && !broken_ && !ended_) {
    if (chunk_ == Chunk::data) {
      const std::size_t size = std::min(bytes.size(), chunk_left_);
      body_.insert(body_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      bytes = bytes.subspan(size);
      if ((chunk_left_ -= size) == 0) chunk_ = Chunk::data_end;
      continue;
    }
    const char c = static_cast<char>(bytes.front());
    bytes = bytes.subspan(1);
    if (chunk_ == Chunk::data_end) {
      broken_ = c != '\r' && c != '\n';
      if (c == '\n') chunk_ = Chunk::size;
    } else if (c == '\n') {
      end_size_line();
    } else if (size_line_.size() < kSizeLineMax) {
      size_line_ += c;
    } else {
      broken_ = true;
    }
  }
}

// "1f4;extension=x"
void NtripAnswer::end_size_line() {
  const std::string_view line = trimmed(size_line_);
  const auto size = whole_number<std::size_t>(trimmed(line.substr(0, line.find(';'))), 16);
  broken_ = !size || *size > kChunkMax;
  ended_ = size == std::size_t{0};
  chunk_left_ = size.value_or(0);
  chunk_ = Chunk::data;
  size_line_.clear();
}

}  // namespace drivers
