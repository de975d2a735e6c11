// What is asked of a caster and what it answers, byte by byte; and what is read in corrections.
#include "drivers/ntrip_codec.hpp"

#include <gmock/gmock.h>

#include "drivers/gnss_demux.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/rtcm3.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::from_hex;
using testing::HasSubstr;

NtripRequest request_in(NtripVersion version) {
  NtripRequest r;
  r.host = "rtk.example.org";
  r.mountpoint = "SITE0";
  r.user = "Aladdin";
  r.password = "open sesame";
  r.version = version;
  return r;
}

struct ReadAnswer {
  NtripAnswer answer;
  Bytes body;
};

// Fed in pieces of that size.
ReadAnswer read_answer(std::string_view text, std::size_t piece) {
  ReadAnswer result;
  for (std::size_t at = 0; at < text.size(); at += piece) {
    result.answer.feed(as_bytes(text.substr(at, piece)));
    const ByteView body = result.answer.body();
    result.body.insert(result.body.end(), body.begin(), body.end());
  }
  return result;
}

TEST(Ntrip, AsksAsTheVersionsSay) {
  EXPECT_EQ(ntrip_request(request_in(NtripVersion::v1)),
            "GET /SITE0 HTTP/1.0\r\nUser-Agent: NTRIP Vantage/1.0\r\n"
            "Authorization: Basic QWxhZGRpbjpvcGVuIHNlc2FtZQ==\r\n\r\n");
  EXPECT_EQ(ntrip_request(request_in(NtripVersion::v2), "$GPGGA,1*00\r\n"),
            "GET /SITE0 HTTP/1.1\r\nHost: rtk.example.org:2101\r\nNtrip-Version: Ntrip/2.0\r\n"
            "User-Agent: NTRIP Vantage/1.0\r\n"
            "Authorization: Basic QWxhZGRpbjpvcGVuIHNlc2FtZQ==\r\n"
            "Ntrip-GGA: $GPGGA,1*00\r\nConnection: close\r\n\r\n");
}

TEST(Ntrip, EncodesBase64AsItsStandardSays) {
  for (const auto& [text, coded] :
       {std::pair("", ""), std::pair("f", "Zg=="), std::pair("fo", "Zm8="),
        std::pair("foo", "Zm9v"), std::pair("foob", "Zm9vYg=="), std::pair("foobar", "Zm9vYmFy")})
    EXPECT_EQ(base64(text), coded);
}

TEST(Ntrip, ACasterReadsWhatWeAsk) {
  for (const auto version : {NtripVersion::v1, NtripVersion::v2}) {
    const std::string text = ntrip_request(request_in(version), "$GPGGA,1*00\r\n");
    for (std::size_t size = 0; size < text.size(); ++size)
      EXPECT_FALSE(parse_ntrip_request(text.substr(0, size)));
    const auto asked = parse_ntrip_request(text + "$GP");
    ASSERT_TRUE(asked);
    EXPECT_EQ(asked->mountpoint, "SITE0");
    EXPECT_EQ(asked->user, "Aladdin");
    EXPECT_EQ(asked->password, "open sesame");
    EXPECT_EQ(asked->version, version);
    EXPECT_EQ(asked->size, text.size());
    EXPECT_EQ(asked->gga, version == NtripVersion::v2 ? "$GPGGA,1*00" : "");
  }
}

TEST(Ntrip, RefusesToAskForWhatWouldBreakTheRequest) {
  const auto problem = [](auto&& change) {
    NtripRequest r = request_in(NtripVersion::v2);
    change(r);
    return ntrip_request_problem(r);
  };
  EXPECT_EQ(problem([](auto&) {}), "");
  EXPECT_THAT(problem([](auto& r) { r.mountpoint = ""; }), HasSubstr("no mountpoint"));
  EXPECT_THAT(problem([](auto& r) { r.mountpoint = "A B"; }), HasSubstr("blanks"));
  EXPECT_THAT(problem([](auto& r) { r.mountpoint = "A\r\nX: y"; }), HasSubstr("control"));
  EXPECT_THAT(problem([](auto& r) { r.host = ""; }), HasSubstr("host"));
  EXPECT_THAT(problem([](auto& r) { r.user = "a:b"; }), HasSubstr("colon"));
  const std::string said = problem([](auto& r) { r.password = "secret\r\nX: y"; });
  EXPECT_THAT(said, HasSubstr("one line"));
  EXPECT_EQ(said.find("secret"), std::string::npos);
}

struct AnswerCase {
  std::string text;
  NtripVerdict verdict;
  std::string body;
};

TEST(Ntrip, TellsAnswersApartHoweverTheyArrive) {
  const std::string data("\xD3\x00\x02\x3E\xD0", 5);
  const AnswerCase cases[] = {
      {"ICY 200 OK\r\n\r\n" + data, NtripVerdict::stream, data},
      {"ICY 200 OK\r\n" + data, NtripVerdict::stream, data},
      {"ICY 200 OK\r\nServer: x\r\nDate: y\r\n\r\n" + data, NtripVerdict::stream, data},
      {"HTTP/1.1 200 OK\r\nContent-Type: gnss/data\r\n\r\n" + data, NtripVerdict::stream, data},
      {"HTTP/1.1 200 OK\r\ncontent-type:gnss/data\r\nTransfer-Encoding: Chunked\r\n\r\n3\r\n" +
           data.substr(0, 3) + "\r\n2;name=value\r\n" + data.substr(3) + "\r\n0\r\n\r\n",
       NtripVerdict::stream, data},
      {"SOURCETABLE 200 OK\r\nSTR;A\r\n", NtripVerdict::source_table, "STR;A\r\n"},
      {"HTTP/1.1 200 OK\r\nContent-Type: gnss/sourcetable\r\n\r\nSTR;A\r\n",
       NtripVerdict::source_table, "STR;A\r\n"},
      {"HTTP/1.0 401 Unauthorized\r\n\r\n", NtripVerdict::unauthorised, ""},
      {"HTTP/1.1 403 Forbidden\r\n\r\n", NtripVerdict::unauthorised, ""},
      {"ERROR - Bad Password\r\n", NtripVerdict::unauthorised, ""},
      {"HTTP/1.1 404 Not Found\r\n\r\n", NtripVerdict::not_found, ""},
      {"ERROR - Mount Point Taken or Invalid\r\n", NtripVerdict::not_found, ""},
      {"HTTP/1.1 503 Service Unavailable\r\n\r\n", NtripVerdict::refused, ""},
      {"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<html>", NtripVerdict::foreign, "<html>"},
      {"SSH-2.0-OpenSSH_9.2\r\n", NtripVerdict::foreign, ""},
      {std::string(2000, 'x'), NtripVerdict::foreign, ""}};
  for (const AnswerCase& each : cases)
    for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, each.text.size()}) {
      const ReadAnswer got = read_answer(each.text, piece);
      EXPECT_EQ(got.answer.verdict(), each.verdict) << each.text;
      if (each.text.size() < 2000) {
        EXPECT_EQ(as_text(got.body), each.body) << each.text;
      }
      EXPECT_FALSE(got.answer.broken()) << each.text;
      EXPECT_EQ(got.answer.ended(), each.text.find("\r\n0\r\n") != std::string::npos);
      EXPECT_LE(got.answer.status().size(), 120U);
    }
}

TEST(Ntrip, SaysWhenChunksAreOutOfStep) {
  const std::string head = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (const char* chunks :
       {"xyz\r\n", "2\r\nabcd\r\n", "\r\n", "ffffffffffffffffff\r\n", "fffffff\r\n",
        "11111111111111111111111111111111111111111111111111111"
        "11111111111111111111"})
    EXPECT_TRUE(read_answer(head + chunks, 1).answer.broken()) << chunks;
}

TEST(Ntrip, ReadsATableOfSources) {
  const auto source = ntrip_source(
      "STR;SITE0;Here;RTCM 3.2;1005(10),1077(1);2;GPS+GLO;Net;DEU;48.00;11.00;1;0;x;none;B;N;1;\r");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->mountpoint, "SITE0");
  EXPECT_EQ(source->format, "RTCM 3.2");
  EXPECT_TRUE(source->wants_position);
  EXPECT_FALSE(ntrip_source("CAS;rtk.example.org;2101"));
  EXPECT_FALSE(ntrip_source("STR;"));
  EXPECT_FALSE(ntrip_source("STR;SHORT")->wants_position);
}

// The standard's own example, as it reads in gpsd too.
TEST(Rtcm3, ReadsWhereTheBaseStands) {
  const Bytes frame = from_hex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98");
  const auto base_m = rtcm3_base_m(frame);
  ASSERT_TRUE(base_m);
  const Eigen::Vector3d standard_m(1114104.5999, -4850729.7108, 3975521.4643);
  EXPECT_LT((*base_m - standard_m).norm(), 1e-6);
  const Bytes again = encode_rtcm3_base(2003, standard_m);
  EXPECT_LT((*rtcm3_base_m(again) - standard_m).norm(), 1e-6);
  EXPECT_FALSE(rtcm3_epoch(frame));
  EXPECT_FALSE(rtcm3_base_m(encode_rtcm3(from_hex("3ed0"))));
}

TEST(Rtcm3, ReadsWhenObservationsWereMade) {
  const Bytes content(50, 0xA5);
  const auto gps = rtcm3_epoch(encode_rtcm3_msm(1077, 1, 345'678'000, content));
  ASSERT_TRUE(gps);
  EXPECT_EQ(gps->type, 1077);
  EXPECT_EQ(gps->tow_ms, 345'678'000U);
  const auto glonass = rtcm3_epoch(encode_rtcm3_msm(1087, 1, 3U << 27 | 1000, content));
  ASSERT_TRUE(glonass);
  EXPECT_EQ(glonass->raw, 3U << 27 | 1000);
  EXPECT_FALSE(glonass->tow_ms);
  EXPECT_FALSE(rtcm3_epoch(encode_rtcm3_msm(1230, 1, 5, content)));
}

// Golden: every frame of a recording, its type and the base's place, as gpsd 3.22 reads them.
TEST(Rtcm3, ReadsARecordingAsGpsdDoes) {
  RECORDING_OR_SKIP(log, "gnss/rtcm3.log");
  RECORDING_OR_SKIP(golden, "gnss/rtcm3.log.chk");
  std::vector<Bytes> frames;
  for (const Bytes& frame : drivers_test::frames_in(as_bytes(log), look_gnss, kGnssFrameMax))
    if (gnss_kind(frame) == GnssKind::rtcm3) frames.push_back(frame);
  std::istringstream lines(golden);
  std::size_t at = 0, bases = 0;
  for (std::string line; std::getline(lines, line); ++at) {
    const auto said = boost::json::parse(line);
    ASSERT_LT(at, frames.size());
    const Bytes& frame = frames[at];
    EXPECT_EQ(rtcm3_type(frame), said.at("type").to_number<int>());
    EXPECT_EQ(frame.size(), 6 + said.at("length").to_number<std::size_t>());
    EXPECT_EQ(encode_rtcm3(ByteView(frame).subspan(3, frame.size() - 6)), frame);
    if (rtcm3_type(frame) != 1005) continue;
    ++bases;
    const auto base_m = rtcm3_base_m(frame);
    ASSERT_TRUE(base_m);
    EXPECT_NEAR(base_m->x(), said.at("x").to_number<double>(), 5e-5);
    EXPECT_NEAR(base_m->y(), said.at("y").to_number<double>(), 5e-5);
    EXPECT_NEAR(base_m->z(), said.at("z").to_number<double>(), 5e-5);
  }
  EXPECT_EQ(at, frames.size());
  EXPECT_GE(bases, 1U);
}

TEST(Nmea, WritesAGgaThatReadsBackTheSame) {
  GnssEpoch epoch;
  epoch.mode = 3;
  epoch.quality = GnssQuality::rtk_float;
  epoch.time_of_day_ns = 45'296'780'000'000;
  epoch.latitude = ExactAngle{-(33 * 60 + 7) * 1'000'000'000LL - 123'456'700};
  epoch.longitude = ExactAngle{(8 * 60 + 59) * 1'000'000'000LL + 999'999'900};
  epoch.altitude_msl_m = 480.25;
  epoch.geoid_separation_m = 46;
  epoch.satellites_used = 9;
  epoch.hdop = 0.8;
  const std::string text = nmea_gga(epoch);
  EXPECT_EQ(text.substr(0, text.find('*')),
            "$GPGGA,123456.78,3307.1234567,S,00859.9999999,E,5,09,0.8,480.250,M,46.000,M,,");
  const auto sentence = parse_nmea(as_bytes(text));
  ASSERT_TRUE(sentence);
  const auto& gga = std::get<NmeaGga>(sentence->value);
  EXPECT_EQ(gga.latitude, epoch.latitude);
  EXPECT_EQ(gga.longitude, epoch.longitude);
  EXPECT_EQ(gga.time_of_day_ns, epoch.time_of_day_ns);
  EXPECT_EQ(gga.quality, 5);
}

}  // namespace
}  // namespace drivers
