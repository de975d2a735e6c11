#include "tools/captures.hpp"

#include <array>
#include <stdexcept>
#include <utility>

#include "drivers/text.hpp"
#include "tools/captures_parts.hpp"

namespace captures {
namespace {

constexpr std::array<std::pair<Format, std::string_view>, 6> kNames{{
    {Format::detect, "detect"},
    {Format::pcap, "pcap"},
    {Format::json, "json"},
    {Format::candump, "candump"},
    {Format::socat, "socat"},
    {Format::raw, "raw"},
}};

constexpr std::string_view kBlanks = " \t\r";

Capture read_raw(std::string_view file, Builder builder) {
  Piece piece;
  const auto bytes = drivers::as_bytes(file);
  piece.bytes.assign(bytes.begin(), bytes.end());
  piece.conversation = builder.conversation("bytes");
  builder.add(std::move(piece));
  return builder.take();
}

bool looks_like_json(std::string_view file) {
  const auto at = file.find_first_not_of(" \t\r\n");
  return at != std::string_view::npos && file[at] == '[' &&
         file.substr(0, 4096).find("\"_source\"") != std::string_view::npos;
}

}  // namespace

std::optional<Format> format_named(std::string_view wanted) {
  for (const auto& [format, named] : kNames)
    if (named == wanted) return format;
  return std::nullopt;
}

std::string_view name(Format format) {
  for (const auto& [known, named] : kNames)
    if (known == format) return named;
  return {};
}

std::string Error::text() const {
  return file + (line > 0 ? ":" + std::to_string(line) : "") + ": " + what;
}

void throw_exception_from_error(const Error& error, const boost::source_location& where) {
  (void)where;
  throw std::runtime_error(error.text());
}

Format detect(std::string_view file) {
  if (looks_like_pcap(file)) return Format::pcap;
  if (looks_like_json(file)) return Format::json;
  if (looks_like_socat(file)) return Format::socat;
  if (looks_like_candump(file)) return Format::candump;
  return Format::raw;
}

Result<Capture> read(std::string_view file, std::string_view file_name, const Options& options) {
  const Format format = options.format == Format::detect ? detect(file) : options.format;
  Builder builder(format, options);
  switch (format) {
    case Format::pcap:
      return read_pcap(file, file_name, std::move(builder));
    case Format::json:
      return read_json(file, file_name, std::move(builder));
    case Format::candump:
      return read_candump(file, file_name, std::move(builder));
    case Format::socat:
      return read_socat(file, file_name, std::move(builder));
    case Format::detect:
    case Format::raw:
      break;
  }
  return read_raw(file, std::move(builder));
}

std::size_t Builder::conversation(const std::string& name) {
  const auto [at, fresh] = numbers_.try_emplace(name, numbers_.size());
  if (fresh) capture_.conversations.push_back(name);
  return at->second;
}

void Builder::add(Piece piece) {
  if (options_.swap_sides) piece.from_device = !piece.from_device;
  capture_.pieces.push_back(std::move(piece));
}

void Builder::skip(std::string_view why, std::size_t bytes) {
  drivers::skip(capture_.skipped, why, bytes);
}

std::string_view take_line(std::string_view& rest) {
  auto line = drivers::take_field(rest, '\n');
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view take_word(std::string_view& rest) {
  const auto begin = std::min(rest.find_first_not_of(kBlanks), rest.size());
  rest.remove_prefix(begin);
  const auto word = rest.substr(0, rest.find_first_of(kBlanks));
  rest.remove_prefix(word.size());
  return word;
}

}  // namespace captures
