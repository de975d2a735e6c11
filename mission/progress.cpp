#include "mission/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace mission {
namespace {

bool continues_character(char c) {
  return (static_cast<unsigned char>(c) & 0xC0) == 0x80;
}

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return !continues_character(c); }));
}

// A name from a file may hold anything; a control character would break the line.
std::string printable(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  }
  return text;
}

std::string station_text(const Progress& progress) {
  if (progress.station <= 0) return "";
  if (progress.stations <= 0) return fmt::format("{}", progress.station);
  return fmt::format("{}/{}", progress.station, progress.stations);
}

std::string joined(const std::vector<std::string>& parts) {
  std::string line;
  for (const std::string& part : parts) {
    if (!part.empty()) line += (line.empty() ? "" : "  ") + part;
  }
  return line;
}

std::string line_with(const Progress& progress, std::size_t area_columns) {
  std::string where = station_text(progress);
  const std::string area = shortened(printable(progress.area), area_columns);
  if (!where.empty() && !area.empty()) where += ' ';
  where += area;
  std::vector<std::string> parts{printable(progress.phase), where};
  if (progress.coverage) {
    parts.push_back(fmt::format("cover {:.1f} %", 100 * *progress.coverage));
  }
  if (progress.seen_occupied > 0) {
    parts.push_back("occupied " + count_text(progress.seen_occupied));
  }
  parts.push_back(duration_text(progress.mission_s));
  if (progress.eta_s) parts.push_back("left " + duration_text(*progress.eta_s));
  return joined(parts);
}

}  // namespace

std::string progress_line(const Progress& progress) {
  std::string line = line_with(progress, kProgressColumns);
  const std::size_t area = std::min(columns_of(progress.area), kProgressColumns);
  const std::size_t all = columns_of(line);
  if (all > kProgressColumns) {
    const std::size_t over = all - kProgressColumns;
    line = line_with(progress, area > over ? area - over : 0);
  }
  return shortened(line, kProgressColumns);
}

std::string duration_text(double span_s) {
  if (!std::isfinite(span_s)) return "-";
  const auto all = static_cast<std::int64_t>(std::llround(std::clamp(span_s, 0.0, 1e12)));
  const std::int64_t days = all / 86400, hours = all / 3600 % 24, minutes = all / 60 % 60;
  const std::int64_t left = all % 60;
  if (days > 0) return fmt::format("{}d {:02}:{:02}:{:02}", days, hours, minutes, left);
  if (hours > 0) return fmt::format("{}:{:02}:{:02}", hours, minutes, left);
  return fmt::format("{}:{:02}", minutes, left);
}

std::string count_text(std::uint64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, 1, ',');
  return text;
}

std::string shortened(std::string_view text, std::size_t columns) {
  if (columns_of(text) <= columns) return std::string(text);
  constexpr std::string_view kCut = "..";
  const std::size_t room = columns > kCut.size() ? columns - kCut.size() : 0;
  std::size_t end = 0;
  for (std::size_t shown = 0; end < text.size(); ++end) {
    if (!continues_character(text[end]) && shown++ == room) break;
  }
  return std::string(text.substr(0, end)) +
         std::string(kCut.substr(0, std::min(columns, kCut.size())));
}

void ProgressPrinter::show(const Progress& progress) {
  std::string line = progress_line(progress);
  if (line == line_) return;
  if (is_terminal_) {
    out_ << "\r\x1b[K" << line << std::flush;
  } else {
    out_ << line << '\n' << std::flush;
  }
  line_ = std::move(line);
}

void ProgressPrinter::message(std::string_view text) {
  if (is_terminal_ && !line_.empty()) out_ << "\r\x1b[K";
  out_ << text << '\n';
  if (is_terminal_) out_ << line_;
  out_ << std::flush;
}

void ProgressPrinter::finish() {
  if (is_terminal_ && !line_.empty()) out_ << '\n' << std::flush;
  line_.clear();
}

}  // namespace mission
