// A person's line on a plain terminal: echo, backspace, history. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace mission {

// Bytes in, echo out, whole lines. A line ends with CR, LF or both. Backspace and DEL rub out, ^U
// and ^C drop the line, up and down bring back earlier ones; other control characters and bytes
// above 0x7E spoil the line: whatever damages bytes must not be carried out.
class ConsoleLine {
 public:
  static constexpr std::size_t kCharactersMax = 160;
  static constexpr std::size_t kHistoryMax = 20;  // Then the oldest is forgotten.

  enum class Fault : std::uint8_t {
    none,
    too_long,  // More than kCharactersMax: all of it is dropped.
    damaged,   // It held what is no text.
  };
  struct Entered {
    std::string text;
    Fault fault = Fault::none;
  };

  // One byte; what is to be shown for it is added to `echo`. A line when it ended one.
  std::optional<Entered> take(std::uint8_t byte, std::string& echo);

  // What is typed from now on is neither shown nor kept (a password).
  void hide(bool hidden) { hidden_ = hidden; }
  void remember(const std::string& line);
  const std::deque<std::string>& history() const { return history_; }  // The newest last.

  // What is shown of the line so far.
  std::string_view shown() const { return hidden_ ? std::string_view{} : text_; }
  // As if nothing had been typed; keeps the history.
  void clear();
  void forget() { history_.clear(); }

 private:
  enum class Escape : std::uint8_t { none, begun, bracket };
  void take_character(char character, std::string& echo);
  bool take_escape(char character, std::string& echo);
  void rub_out(std::string& echo);
  void recall(int step, std::string& echo);
  void replace(std::string text, std::string& echo);
  Entered end_line(std::string& echo);

  std::string text_;
  Fault fault_ = Fault::none;
  bool hidden_ = false, was_return_ = false;
  Escape escape_ = Escape::none;
  std::deque<std::string> history_;
  std::size_t back_ = 0;  // How many lines back in the history; 0: a line of its own.
};

}  // namespace mission
