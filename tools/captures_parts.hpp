// Inside of the capture readers: one function per format, and what they share.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "tools/captures.hpp"

namespace captures {

// Collects pieces. Conversations are numbered in the order in which they turn up.
class Builder {
 public:
  Builder(Format format, const Options& options) : options_(options) { capture_.format = format; }

  const Options& options() const { return options_; }
  std::size_t conversation(const std::string& name);
  void add(Piece piece);
  void skip(std::string_view why, std::size_t bytes);
  Capture take() { return std::move(capture_); }

 private:
  Options options_;
  Capture capture_;
  std::map<std::string, std::size_t> numbers_;
};

Result<Capture> read_pcap(std::string_view file, std::string_view file_name, Builder builder);
Result<Capture> read_json(std::string_view file, std::string_view file_name, Builder builder);
Result<Capture> read_candump(std::string_view file, std::string_view file_name, Builder builder);
Result<Capture> read_socat(std::string_view file, std::string_view file_name, Builder builder);

bool looks_like_pcap(std::string_view file);
bool looks_like_candump(std::string_view file);
bool looks_like_socat(std::string_view file);

// Takes the next line off the front, without its end.
std::string_view take_line(std::string_view& rest);
// Takes the next word off the front: up to blanks.
std::string_view take_word(std::string_view& rest);

}  // namespace captures
