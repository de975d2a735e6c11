#include "drivers/http.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <sstream>

namespace drivers {
namespace {

namespace http = boost::beast::http;

constexpr int kVersion = 11;
constexpr std::size_t kHeadMax = 8192;

template <class Message>
std::string text_of(const Message& message) {
  std::ostringstream text;
  text << message;
  return std::move(text).str();
}

}  // namespace

struct HttpAnswer::Parser {
  http::response_parser<http::string_body> read;
  Bytes waiting;  // Of a head that is not whole.
  bool broken = false;
};

HttpAnswer::HttpAnswer() : parser_(std::make_unique<Parser>()) {
  parser_->read.eager(true);
  parser_->read.header_limit(kHeadMax);
  parser_->read.body_limit(kBodyMax);
}
HttpAnswer::~HttpAnswer() = default;

void HttpAnswer::feed(ByteView bytes) {
  Parser& p = *parser_;
  p.waiting.insert(p.waiting.end(), bytes.begin(), bytes.end());
  while (!p.waiting.empty() && !p.broken && !p.read.is_done()) {
    boost::system::error_code error;
    const std::size_t used =
        p.read.put(boost::asio::buffer(p.waiting.data(), p.waiting.size()), error);
    p.waiting.erase(p.waiting.begin(), p.waiting.begin() + static_cast<std::ptrdiff_t>(used));
    if (error == http::error::need_more) return;
    p.broken = error.failed();
    if (used == 0) return;
  }
}

bool HttpAnswer::whole() const {
  return parser_->read.is_done();
}
bool HttpAnswer::broken() const {
  return parser_->broken;
}
int HttpAnswer::status() const {
  return parser_->read.get().result_int();
}
std::string HttpAnswer::take_body() {
  return std::move(parser_->read.get().body());
}

std::string http_get(std::string_view host, std::string_view path) {
  http::request<http::empty_body> request(http::verb::get, {path.data(), path.size()}, kVersion);
  request.set(http::field::host, {host.data(), host.size()});
  request.set(http::field::accept, "application/json");
  request.keep_alive(true);
  return text_of(request);
}

std::optional<HttpAsked> parse_http_get(std::string_view text) {
  http::request_parser<http::empty_body> read;
  read.header_limit(kHeadMax);
  read.eager(true);
  boost::system::error_code error;
  const std::size_t used = read.put(boost::asio::buffer(text.data(), text.size()), error);
  if (error || !read.is_done() || read.get().method() != http::verb::get) return std::nullopt;
  const auto target = read.get().target();
  return HttpAsked{std::string(target.data(), target.size()), used};
}

std::string http_answer(int status, std::string_view json) {
  http::response<http::string_body> answer(static_cast<http::status>(status), kVersion);
  answer.set(http::field::content_type, "application/json");
  answer.keep_alive(true);
  answer.body() = json;
  answer.prepare_payload();
  return text_of(answer);
}

}  // namespace drivers
