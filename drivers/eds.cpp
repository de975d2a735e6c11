#include "drivers/eds.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "drivers/eds_text.hpp"

namespace drivers::eds {
namespace {

constexpr unsigned kBaudRates[]{10, 20, 50, 125, 250, 500, 800, 1000};
constexpr std::size_t kNotesMax = 50;
constexpr std::uint8_t kArray = 8, kRecord = 9, kVariable = 7;

struct TypeFact {
  Type type;
  unsigned bits;
  bool is_signed;
};
constexpr TypeFact kTypes[] = {
    {Type::boolean, 1, false}, {Type::int8, 8, true},    {Type::int16, 16, true},
    {Type::int32, 32, true},   {Type::uint8, 8, false},  {Type::uint16, 16, false},
    {Type::uint32, 32, false}, {Type::real32, 32, true}, {Type::int24, 24, true},
    {Type::real64, 64, true},  {Type::int64, 64, true},  {Type::uint24, 24, false},
    {Type::uint64, 64, false},
};

const TypeFact* fact_of(std::uint16_t type) {
  const auto* found = std::find_if(std::begin(kTypes), std::end(kTypes), [&](const TypeFact& fact) {
    return static_cast<std::uint16_t>(fact.type) == type;
  });
  return found == std::end(kTypes) ? nullptr : found;
}

bool is_integer(std::uint16_t type) {
  return fact_of(type) != nullptr && type != static_cast<std::uint16_t>(Type::real32) &&
         type != static_cast<std::uint16_t>(Type::real64);
}

// "1018" or "1018sub1"; nothing for other sections.
std::optional<std::pair<canopen::Address, bool>> address_of(const std::string& name) {
  if (name.size() < 4) return std::nullopt;
  canopen::Address at;
  const auto* end = name.data() + name.size();
  const auto index = std::from_chars(name.data(), name.data() + 4, at.index, 16);
  if (index.ec != std::errc() || index.ptr != name.data() + 4) return std::nullopt;
  if (name.size() == 4) return std::pair{at, false};
  if (name.compare(4, 3, "sub") != 0) return std::nullopt;
  const auto sub = std::from_chars(name.data() + 7, end, at.sub, 16);
  if (sub.ec != std::errc() || sub.ptr != end || name.size() == 7) return std::nullopt;
  return std::pair{at, true};
}

// A value counts as given only when it is not empty.
const Value* given(const Section& section, const std::string& key) {
  const Value* value = section.find(key);
  return value == nullptr || value->text.empty() ? nullptr : value;
}

class Parser {
 public:
  Parser(std::string_view text, std::string_view file) : text_(text, file) {}

  Result<Description> parse() {
    read_device();
    read_commissioning();
    for (const auto& [name, section] : text_.sections()) read_entry(name, section);
    for (const std::string list : {"mandatoryobjects", "optionalobjects", "manufacturerobjects"})
      check_list(list);
    check_parts();
    if (text_.sections().empty() && text_.errors().empty())
      text_.refuse(1, "", "", "give a file with [Section] lines: this one has none");
    if (!text_.errors().empty()) return text_.errors();
    return std::move(description_);
  }

 private:
  std::optional<Number> number(const Section& section, const std::string& key, const char* field) {
    const Value* value = given(section, key);
    if (value == nullptr) return std::nullopt;
    const auto read = parse_number(value->text);
    if (!read) text_.refuse(value->line, field, value->text, "write a number like 31 or 0x1F");
    return read;
  }

  // A number without $NODEID and in range.
  std::optional<std::int64_t> plain(const Section& section, const std::string& key,
                                    const char* field, std::int64_t least, std::int64_t most) {
    const auto read = number(section, key, field);
    if (!read) return std::nullopt;
    if (!read->plus_node_id && read->value >= least && read->value <= most) return read->value;
    text_.refuse(section.find(key)->line, field, section.find(key)->text,
                 "write a number from " + std::to_string(least) + " to " + std::to_string(most));
    return std::nullopt;
  }

  static std::string text_at(const Section& section, const std::string& key) {
    const Value* value = section.find(key);
    return value == nullptr ? std::string() : value->text;
  }

  void read_device() {
    const Section* device = text_.find("deviceinfo");
    if (device == nullptr) return;
    description_.vendor = text_at(*device, "vendorname");
    description_.product = text_at(*device, "productname");
    const auto word = [&](const char* key, const char* field) {
      const auto read = plain(*device, key, field, 0, 0xFFFFFFFF);
      return read ? std::optional(static_cast<std::uint32_t>(*read)) : std::nullopt;
    };
    description_.vendor_number = word("vendornumber", "VendorNumber");
    description_.product_number = word("productnumber", "ProductNumber");
    description_.revision = word("revisionnumber", "RevisionNumber");
    for (const unsigned rate : kBaudRates) {
      const auto field = "BaudRate_" + std::to_string(rate);
      if (plain(*device, lower(field), field.c_str(), 0, 1).value_or(0) == 1)
        description_.baud_rates_kbps.push_back(rate);
    }
  }

  // CiA 306 spells it "DeviceComissioning"; files have both.
  void read_commissioning() {
    for (const std::string name : {"devicecomissioning", "devicecommissioning"}) {
      const Section* section = text_.find(name);
      if (section == nullptr) continue;
      if (const auto node = plain(*section, "nodeid", "NodeID", 1, 127))
        description_.node = static_cast<std::uint8_t>(*node);
      if (const auto baud = plain(*section, "baudrate", "Baudrate", 1, 1000))
        description_.node_baud_kbps = static_cast<unsigned>(*baud);
    }
  }

  void read_entry(const std::string& name, const Section& section) {
    const auto at = address_of(name);
    if (!at) return;
    Entry entry;
    entry.line = section.line;
    entry.name = text_at(section, "parametername");
    if (section.find("parametername") == nullptr)
      text_.refuse(section.line, "ParameterName", "", "name the object");
    entry.object_type = static_cast<std::uint8_t>(
        plain(section, "objecttype", "ObjectType", 0, 9).value_or(kVariable));
    entry.data_type =
        static_cast<std::uint16_t>(plain(section, "datatype", "DataType", 0, 0xFFFF).value_or(0));
    entry.pdo_mappable = plain(section, "pdomapping", "PDOMapping", 0, 1).value_or(0) == 1;
    read_access(section, entry);
    read_values(section, entry);
    const bool is_variable = entry.object_type == kVariable;
    if (is_variable && section.find("datatype") == nullptr)
      text_.refuse(section.line, "DataType", "", "give the variable a data type");
    add_compact_parts(at->first.index, name, section, entry);
    if (at->second)
      description_.parts.emplace(at->first, std::move(entry));
    else
      description_.objects.emplace(at->first.index, std::move(entry));
  }

  // CompactSubObj=N: an array whose N parts are all alike and are described with the array. They
  // may have names in [XXXXName].
  void add_compact_parts(std::uint16_t index, const std::string& name, const Section& section,
                         const Entry& array) {
    const auto count = plain(section, "compactsubobj", "CompactSubObj", 0, 254).value_or(0);
    if (count == 0) return;
    const Section* names = text_.find(name + "name");
    Entry part = array;
    part.object_type = kVariable;
    for (std::int64_t i = 1; i <= count; ++i) {
      const Value* named = names == nullptr ? nullptr : given(*names, std::to_string(i));
      part.name = named != nullptr ? named->text : array.name + std::to_string(i);
      description_.parts.emplace(canopen::Address{index, static_cast<std::uint8_t>(i)}, part);
    }
    Entry entries;
    entries.name = "Number of entries";
    entries.data_type = static_cast<std::uint16_t>(Type::uint8);
    entries.access = Access::read_only;
    entries.default_value = Number{count, false};
    entries.default_text = std::to_string(count);
    entries.line = array.line;
    description_.parts.emplace(canopen::Address{index, 0}, entries);
  }

  void read_access(const Section& section, Entry& entry) {
    const Value* value = given(section, "accesstype");
    if (value == nullptr) {
      if (entry.object_type == kVariable)
        text_.refuse(section.line, "AccessType", "", "write ro, wo, rw, rwr, rww or const");
      return;
    }
    static const std::map<std::string, Access> kNames{
        {"ro", Access::read_only},   {"wo", Access::write_only},  {"rw", Access::read_write},
        {"rwr", Access::read_write}, {"rww", Access::read_write}, {"const", Access::constant}};
    const auto found = kNames.find(lower(value->text));
    if (found == kNames.end())
      text_.refuse(value->line, "AccessType", value->text, "write ro, wo, rw, rwr, rww or const");
    else
      entry.access = found->second;
  }

  void read_values(const Section& section, Entry& entry) {
    entry.default_text = text_at(section, "defaultvalue");
    if (!is_integer(entry.data_type)) return;
    entry.default_value = number(section, "defaultvalue", "DefaultValue");
    entry.parameter_value = number(section, "parametervalue", "ParameterValue");
    entry.low_limit = number(section, "lowlimit", "LowLimit");
    entry.high_limit = number(section, "highlimit", "HighLimit");
  }

  // [OptionalObjects] SupportedObjects=2, 1=0x1002, 2=0x1003: each must have its section.
  void check_list(const std::string& name) {
    const Section* list = text_.find(name);
    if (list == nullptr) return;
    const auto count = plain(*list, "supportedobjects", "SupportedObjects", 0, 0xFFFF).value_or(0);
    for (std::int64_t i = 1; i <= count; ++i) {
      const auto key = std::to_string(i);
      const auto index = plain(*list, key, key.c_str(), 1, 0xFFFF);
      const Value* listed = list->find(key);
      if (listed == nullptr)
        return note(
            {text_.file(), list->line, key, "", "list as many objects as SupportedObjects says"});
      if (index && !description_.objects.contains(static_cast<std::uint16_t>(*index)))
        note({text_.file(), listed->line, key, listed->text,
              "describe the object in a section of that name"});
    }
  }

  void note(Error error) {
    if (description_.notes.size() < kNotesMax) description_.notes.push_back(std::move(error));
  }

  void check_parts() {
    for (const auto& [at, part] : description_.parts) {
      const auto whole = description_.objects.find(at.index);
      const bool fits =
          whole != description_.objects.end() &&
          (whole->second.object_type == kArray || whole->second.object_type == kRecord);
      if (!fits)
        text_.refuse(part.line, "", part.name,
                     "describe the array or record (ObjectType 8 or 9) that this is a part of");
    }
  }

  Text text_;
  Description description_;
};

}  // namespace

std::string Error::text() const {
  std::string text = file + ":" + std::to_string(line) + ": ";
  if (!field.empty()) text += field + " = ";
  if (!value.empty() || !field.empty()) text += value.empty() ? "(nothing): " : value + ": ";
  return text + remedy;
}

void throw_exception_from_error(const Errors& errors, const boost::source_location& where) {
  (void)where;
  throw std::runtime_error(errors.front().text());
}

std::optional<unsigned> bits_of(std::uint16_t type) {
  const TypeFact* fact = fact_of(type);
  return fact == nullptr ? std::nullopt : std::optional(fact->bits);
}

bool is_signed(std::uint16_t type) {
  const TypeFact* fact = fact_of(type);
  return fact != nullptr && fact->is_signed;
}

const Entry* Description::find(canopen::Address at) const {
  const auto part = parts.find(at);
  if (part != parts.end()) return &part->second;
  const auto object = objects.find(at.index);
  const bool plain = object != objects.end() && at.sub == 0 &&
                     object->second.object_type != kArray && object->second.object_type != kRecord;
  return plain ? &object->second : nullptr;
}

Result<Description> parse(std::string_view text, std::string_view file) {
  return Parser(text, file).parse();
}

}  // namespace drivers::eds
