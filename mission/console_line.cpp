#include "mission/console_line.hpp"

#include <utility>

namespace mission {
namespace {

constexpr char kInterrupt = 0x03, kBackspace = 0x08, kKill = 0x15, kEscape = 0x1B, kDelete = 0x7F;

bool is_text(char character) {
  return character >= ' ' && character < kDelete;
}

}  // namespace

std::optional<ConsoleLine::Entered> ConsoleLine::take(std::uint8_t byte, std::string& echo) {
  const char character = static_cast<char>(byte);
  const bool after_return = std::exchange(was_return_, character == '\r');
  if (character == '\n' && after_return) return std::nullopt;  // The end of that end.
  if (character == '\r' || character == '\n') return end_line(echo);
  if (!take_escape(character, echo)) take_character(character, echo);
  return std::nullopt;
}

void ConsoleLine::take_character(char character, std::string& echo) {
  if (is_text(character)) {
    if (text_.size() >= kCharactersMax) {
      fault_ = Fault::too_long;
      return;
    }
    text_ += character;
    if (!hidden_) echo += character;
  } else if (character == kBackspace || character == kDelete) {
    rub_out(echo);
  } else if (character == kInterrupt || character == kKill) {
    replace("", echo);
    fault_ = Fault::none;
  } else if (fault_ == Fault::none) {
    fault_ = Fault::damaged;
  }
}

// Arrow keys send "ESC [ A" and the like. True: this byte belongs to such a key.
bool ConsoleLine::take_escape(char character, std::string& echo) {
  const Escape was = std::exchange(escape_, Escape::none);
  if (character == kEscape) {
    escape_ = Escape::begun;
    return true;
  }
  if (was == Escape::begun) {
    if (character == '[') escape_ = Escape::bracket;
    return character == '[';
  }
  if (was != Escape::bracket) return false;
  if (character == 'A') recall(+1, echo);
  if (character == 'B') recall(-1, echo);
  if (!is_text(character)) return false;
  if (character < '@') escape_ = Escape::bracket;  // A number: more of the same key follows.
  return true;
}

void ConsoleLine::rub_out(std::string& echo) {
  if (text_.empty()) return;
  text_.pop_back();
  if (!hidden_) echo += "\b \b";
}

void ConsoleLine::recall(int step, std::string& echo) {
  if (hidden_ || (step < 0 && back_ == 0) || (step > 0 && back_ == history_.size())) return;
  back_ = step > 0 ? back_ + 1 : back_ - 1;
  replace(back_ == 0 ? "" : history_[history_.size() - back_], echo);
}

void ConsoleLine::replace(std::string text, std::string& echo) {
  while (!text_.empty()) rub_out(echo);
  text_ = std::move(text);
  if (!hidden_) echo += text_;
}

ConsoleLine::Entered ConsoleLine::end_line(std::string& echo) {
  echo += "\r\n";
  Entered entered{std::move(text_), fault_};
  clear();
  return entered;
}

void ConsoleLine::remember(const std::string& line) {
  if (line.empty() || (!history_.empty() && history_.back() == line)) return;
  history_.push_back(line);
  if (history_.size() > kHistoryMax) history_.pop_front();
}

void ConsoleLine::clear() {
  text_.clear();
  fault_ = Fault::none;
  escape_ = Escape::none;
  back_ = 0;
}

}  // namespace mission
