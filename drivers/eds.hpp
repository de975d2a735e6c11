// CiA 306 device descriptions: EDS (what a device has) and DCF (how one is set).
#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/canopen_sdo.hpp"

namespace drivers::eds {

// "eds:12: DefaultValue = 0xZZ: not a number; write 0x1F or 31"
struct Error {
  std::string file;
  int line{};
  std::string field;  // "DefaultValue", or "" for a line that is no field.
  std::string value;
  std::string remedy;

  std::string text() const;
};
using Errors = std::vector<Error>;  // At least one; at most 50 and then how many more.

template <class T>
using Result = boost::system::result<T, Errors>;
// What Result::value() throws: std::runtime_error with the first error.
[[noreturn]] void throw_exception_from_error(const Errors& errors,
                                             const boost::source_location& where);

// CiA 301 data types as in the files.
enum class Type : std::uint16_t {
  boolean = 0x01,
  int8 = 0x02,
  int16 = 0x03,
  int32 = 0x04,
  uint8 = 0x05,
  uint16 = 0x06,
  uint32 = 0x07,
  real32 = 0x08,
  visible_string = 0x09,
  octet_string = 0x0A,
  unicode_string = 0x0B,
  domain = 0x0F,
  int24 = 0x10,
  real64 = 0x11,
  int64 = 0x15,
  uint24 = 0x16,
  uint64 = 0x1B,
};
// Bits of a value of that type; nothing for strings, domains and types that are not known.
std::optional<unsigned> bits_of(std::uint16_t type);
bool is_signed(std::uint16_t type);

// A number as the file has it: some are counted from the node's id.
struct Number {
  std::int64_t value{};
  bool plus_node_id{};

  std::int64_t at(std::uint8_t node) const { return value + (plus_node_id ? node : 0); }
  bool operator==(const Number&) const = default;
};

enum class Access : std::uint8_t { read_only, write_only, read_write, constant };

// An object, or one part of an array or record.
struct Entry {
  std::string name;
  std::uint8_t object_type =
      0x07;                      // 2 domain, 5 type, 6 struct type, 7 variable, 8 array, 9 record.
  std::uint16_t data_type{};     // See Type; 0 for arrays and records.
  std::optional<Access> access;  // Missing for arrays and records.
  bool pdo_mappable{};
  // Integer types only; other types keep what the file says in `default_text`.
  std::optional<Number> default_value, low_limit, high_limit;
  std::optional<Number> parameter_value;  // DCF only.
  std::string default_text;
  int line{};  // Of its section.
};

struct Order {
  bool operator()(canopen::Address a, canopen::Address b) const {
    return a.index != b.index ? a.index < b.index : a.sub < b.sub;
  }
};

struct Description {
  std::string vendor, product;
  std::optional<std::uint32_t> vendor_number, product_number, revision;
  std::vector<unsigned> baud_rates_kbps;   // Ascending.
  std::optional<std::uint8_t> node;        // DCF only.
  std::optional<unsigned> node_baud_kbps;  // DCF only.
  std::map<std::uint16_t, Entry> objects;
  std::map<canopen::Address, Entry, Order> parts;  // Of arrays and records, [1018sub1].
  // What is wrong but does not matter here: lists of objects that do not fit the objects.
  std::vector<Error> notes;

  // The variable there: an object itself for sub-index 0 of a plain variable, else a part.
  const Entry* find(canopen::Address at) const;
};

// Reads the text. Unknown sections and keys are passed over, as CiA 306 asks; what a device needs
// to be used is checked: numbers, types, parts without their whole. `file` is for messages.
Result<Description> parse(std::string_view text, std::string_view file);

}  // namespace drivers::eds
