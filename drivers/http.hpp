// HTTP/1.1 as devices serve their settings: a question for a path, an answer with a text. Nothing
// here waits: bytes in, bytes out.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/bytes.hpp"

namespace drivers {

// For a connection that serves more than one.
std::string http_get(std::string_view host, std::string_view path);

// One answer, fed as it comes. What comes behind it is passed over.
class HttpAnswer {
 public:
  static constexpr std::size_t kBodyMax = 1U << 20;

  HttpAnswer();
  ~HttpAnswer();

  void feed(ByteView bytes);
  bool whole() const;
  bool broken() const;  // It is no HTTP, or longer than kBodyMax.
  // Of a whole one.
  int status() const;
  std::string take_body();

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

// The other side, for simulated devices. Nothing while the question is not whole, or is none.
struct HttpAsked {
  std::string path;
  std::size_t size{};
};
std::optional<HttpAsked> parse_http_get(std::string_view text);
std::string http_answer(int status, std::string_view json);

}  // namespace drivers
