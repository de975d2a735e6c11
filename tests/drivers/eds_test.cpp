#include "drivers/eds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/eds_text.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers::eds {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kSmall = R"([DeviceInfo]
VendorName=Acme
ProductName=Drive
VendorNumber=0x101
RevisionNumber=010
BaudRate_500=1
BaudRate_125=1
BaudRate_1000=0

[DeviceComissioning]
NodeID=0x10
Baudrate=500
[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1018

; a comment
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=const
DefaultValue=0x00020192
PDOMapping=0
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Entries
ObjectType=7
DataType=0x05
AccessType=ro
DefaultValue=1
[1018sub1]
ParameterName=Vendor
DataType=0x07
AccessType=ro
[1400]
ParameterName=RPDO
ObjectType=9
[1400SUB1]
ParameterName=COB-ID
ObjectType=7
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x200
ParameterValue=0x300 + $NODEID
[606C]
ParameterName=Velocity
DataType=0x0004
AccessType=rwr
PDOMapping=1
LowLimit=-3000
HighLimit=3000
#ParameterValue=7
[1008]
ParameterName=Name
DataType=0x0009
AccessType=const
DefaultValue=Drive 7
)";

Errors errors_of(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto result = parse(text, "drive.eds");
  return result ? Errors{} : result.error();
}

TEST(Eds, ReadsEveryValueOfASmallFile) {
  const auto result = parse(kSmall, "drive.eds");
  ASSERT_TRUE(result) << result.error()[0].text();
  EXPECT_EQ(result->vendor, "Acme");
  EXPECT_EQ(result->product, "Drive");
  EXPECT_EQ(result->vendor_number, 0x101U);
  EXPECT_EQ(result->product_number, std::nullopt);
  EXPECT_EQ(result->revision, 8U);
  EXPECT_THAT(result->baud_rates_kbps, ElementsAre(125, 500));
  EXPECT_EQ(result->node, 0x10);
  EXPECT_EQ(result->node_baud_kbps, 500U);
  EXPECT_EQ(result->objects.size(), 5U);
  const Entry* type = result->find({0x1000, 0});
  ASSERT_NE(type, nullptr);
  EXPECT_EQ(type->name, "Device type");
  EXPECT_EQ(type->data_type, 7);
  EXPECT_EQ(type->access, Access::constant);
  EXPECT_EQ(type->default_value, (Number{0x20192, false}));
  EXPECT_FALSE(type->pdo_mappable);
  EXPECT_EQ(type->line, 19);
  const Entry* cob = result->find({0x1400, 1});
  ASSERT_NE(cob, nullptr);
  EXPECT_EQ(cob->default_value->at(5), 0x205);
  EXPECT_EQ(cob->parameter_value->at(5), 0x305);
  const Entry* speed = result->find({0x606C, 0});
  ASSERT_NE(speed, nullptr);
  EXPECT_EQ(speed->access, Access::read_write);
  EXPECT_TRUE(speed->pdo_mappable);
  EXPECT_EQ(speed->low_limit, (Number{-3000, false}));
  EXPECT_EQ(speed->high_limit, (Number{3000, false}));
  EXPECT_EQ(speed->parameter_value, std::nullopt);
  EXPECT_EQ(result->find({0x1008, 0})->default_text, "Drive 7");
  EXPECT_EQ(result->find({0x1018, 0})->name, "Entries");
  EXPECT_EQ(result->find({0x1400, 0}), nullptr);  // A record is no variable.
  EXPECT_EQ(result->find({0x1234, 0}), nullptr);
  // The same with the line ends of another system.
  std::string dos;
  for (const char c : std::string_view(kSmall))
    dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(parse(dos, "drive.eds")->objects.size(), 5U);
}

TEST(Eds, NamesFileLineFieldValueAndRemedy) {
  const std::tuple<const char*, const char*, const char*> broken[] = {
      {"VendorNumber=0x101", "VendorNumber=0xZZ",
       "drive.eds:4: VendorNumber = 0xZZ: write a number like 31 or 0x1F"},
      {"BaudRate_500=1", "BaudRate_500=2",
       "drive.eds:6: BaudRate_500 = 2: write a number from 0 to 1"},
      {"NodeID=0x10", "NodeID=128", "drive.eds:11: NodeID = 128: write a number from 1 to 127"},
      {"AccessType=const", "AccessType=maybe",
       "drive.eds:23: AccessType = maybe: write ro, wo, rw, rwr, rww or const"},
      {"AccessType=const", "",
       "drive.eds:19: AccessType = (nothing): write ro, wo, rw, rwr, rww or const"},
      {"DataType=0x0007", "", "drive.eds:19: DataType = (nothing): give the variable a data type"},
      {"ObjectType=0x9", "ObjectType=7", "drive.eds:26: DataType = (nothing)"},
      {"[1000]", "[1000", "drive.eds:19: [1000: close the section's name with ']'"},
      {"; a comment", "comment", "drive.eds:18: comment: write KEY=VALUE"},
      {"[1008]", "[1000]", "drive.eds:58: [1000]: remove it: the section is at line 19 already"},
      {"[DeviceInfo]", "", "drive.eds:2: VendorName = VendorName=Acme: put a [Section] before it"},
      {"$NODEID+0x200", "$NODEID*2", "DefaultValue = $NODEID*2: write a number"},
      {"[1018]", "[1017]", "describe the array or record"}};
  for (const auto& [from, to, message] : broken) {
    const Errors errors = errors_of(kSmall, from, to);
    bool found = false;
    std::string all;
    for (const Error& error : errors) {
      found = found || error.text().find(message) != std::string::npos;
      all += error.text() + "\n";
    }
    EXPECT_TRUE(found) << message << "\nnot among\n" << all;
  }
  EXPECT_FALSE(parse("", "x"));
  EXPECT_FALSE(parse("; nothing\n", "x"));
}

TEST(Eds, NotesListsThatDoNotFitTheObjects) {
  for (const auto& [line, message] :
       {std::pair{"2=0x1019",
                  "drive.eds:16: 2 = 0x1019: describe the object in a section of that name"},
        {"3=0x1018",
         "drive.eds:13: 2 = (nothing): list as many objects as SupportedObjects says"}}) {
    std::string text = kSmall;
    text.replace(text.find("2=0x1018"), 8, line);
    const auto result = parse(text, "drive.eds");
    ASSERT_TRUE(result) << result.error()[0].text();
    ASSERT_EQ(result->notes.size(), 1U);
    EXPECT_EQ(result->notes[0].text(), message);
  }
}

TEST(Eds, StopsTellingAfterFiftyErrors) {
  std::string text = "[Comments]\nLines=0\n[X]\n";
  for (int i = 0; i < 200; ++i) text += "broken\n";
  const auto result = parse(text, "x.eds");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().size(), 51U);
  EXPECT_THAT(result.error().back().text(), HasSubstr("there are more"));
}

TEST(Eds, ReadsNumbersAsTheFilesWriteThem) {
  EXPECT_EQ(parse_number("31"), (Number{31, false}));
  EXPECT_EQ(parse_number(" 0X1f "), (Number{31, false}));
  EXPECT_EQ(parse_number("037"), (Number{31, false}));
  EXPECT_EQ(parse_number("0"), (Number{0, false}));
  EXPECT_EQ(parse_number("-5"), (Number{-5, false}));
  EXPECT_EQ(parse_number("0xFFFFFFFF"), (Number{0xFFFFFFFF, false}));
  EXPECT_EQ(parse_number("$NODEID"), (Number{0, true}));
  EXPECT_EQ(parse_number("$nodeid + 0x80"), (Number{0x80, true}));
  EXPECT_EQ(parse_number("0x180+$NODEID"), (Number{0x180, true}));
  for (const char* bad : {"", "-", "0x", "1 2", "12a", "$NODEID+", "+$NODEID", "$NODEID 5",
                          "1+$NODEID+1", "0x1FFFFFFFFFFFFFFFF", "--1"})
    EXPECT_EQ(parse_number(bad), std::nullopt) << bad;
}

struct Known {
  const char* file;
  const char* product;
  std::size_t objects, parts;
  std::optional<std::uint8_t> node;
};

TEST(Eds, ReadsTheFilesOfOtherMakers) {
  // Counted with grep: sections [XXXX] and [XXXXsubY]; two compact arrays of 3 and 24 parts.
  const Known files[] = {{"CANopenNode_DS301_profile.eds", "New Product", 33, 160, std::nullopt},
                         {"pycanopen_e35.eds", "example", 211, 894, std::nullopt},
                         {"pycanopen_sample.eds", "", 50, 82 + 4 + 25, 0x10},
                         {"ros2_canopen_cia402_slave.eds", "CIA402VTD", 70, 110, std::nullopt},
                         {"ros2_canopen_prbt_0_1.dcf", "", 94, 150, std::nullopt}};
  for (const Known& known : files) {
    RECORDING_OR_SKIP(text, std::string("can/eds/") + known.file);
    const auto result = parse(text, known.file);
    ASSERT_TRUE(result) << result.error()[0].text();
    EXPECT_EQ(result->product, known.product) << known.file;
    EXPECT_EQ(result->objects.size(), known.objects) << known.file;
    EXPECT_EQ(result->parts.size(), known.parts) << known.file;
    EXPECT_EQ(result->node, known.node) << known.file;
  }
}

TEST(Eds, FindsWhatAVelocityDriveNeedsInARealFile) {
  RECORDING_OR_SKIP(text, "can/eds/ros2_canopen_cia402_slave.eds");
  const auto drive = parse(text, "slave.eds");
  ASSERT_TRUE(drive) << drive.error()[0].text();
  const Entry* target = drive->find({0x60FF, 0});
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->data_type, static_cast<std::uint16_t>(Type::int32));
  EXPECT_TRUE(target->pdo_mappable);
  EXPECT_EQ(bits_of(target->data_type), 32U);
  EXPECT_TRUE(is_signed(target->data_type));
  const Entry* status = drive->find({0x6041, 0});
  ASSERT_NE(status, nullptr);
  EXPECT_EQ(bits_of(status->data_type), 16U);
  EXPECT_EQ(status->access, Access::read_only);
}

}  // namespace
}  // namespace drivers::eds
