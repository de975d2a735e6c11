// vantage decode DEVICE FILE: what a device said, from a capture.
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "mission/files.hpp"
#include "tools/captures.hpp"
#include "tools/decoders.hpp"
#include "tools/vantage_command.hpp"
#include "tools/vantage_decode_output.hpp"

namespace vantage {
namespace {

struct DecodeOptions {
  std::string device;
  std::filesystem::path file, metadata;
  std::string format = "detect";
  std::optional<std::uint16_t> port;
  bool swap = false, json = false, csv = false;
};

std::string file_text(const std::filesystem::path& path) {
  auto read = mission::read_file(path);
  if (!read) throw std::runtime_error(read.error().text());
  return std::move(*read);
}

std::string device_names() {
  std::string names;
  for (const auto& device : decoders::devices())
    names += fmt::format("{}{}", names.empty() ? "" : ", ", device.name);
  return names;
}

captures::Capture read_capture(const DecodeOptions& options) {
  const auto format = captures::format_named(options.format);
  if (!format)
    throw std::runtime_error(
        fmt::format("--format = {}: no such format; use detect, pcap, json, candump, socat or raw",
                    options.format));
  auto capture = captures::read(file_text(options.file), options.file.string(),
                                {*format, options.swap, options.port});
  if (!capture) throw std::runtime_error(capture.error().text());
  return std::move(*capture);
}

// Each conversation has a decoder of its own: streams do not mix.
class Decoders {
 public:
  explicit Decoders(const DecodeOptions& options) : name_(options.device) {
    if (!options.metadata.empty()) options_.metadata = file_text(options.metadata);
    for (const auto& device : decoders::devices()) {
      if (device.name != name_) continue;
      if (device.needs_metadata && options.metadata.empty())
        throw std::runtime_error(
            fmt::format("{} needs the sensor's description: add --metadata FILE.json", name_));
      return;
    }
    throw std::runtime_error(
        fmt::format("DEVICE = {}: no such device; use one of {}", name_, device_names()));
  }

  drivers::OfflineDecoder& of(std::size_t conversation) {
    auto& decoder = decoders_[conversation];
    if (!decoder) decoder = decoders::make_decoder(name_, options_);
    return *decoder;
  }
  void add_skipped(drivers::SkippedBy& all) const {
    for (const auto& [conversation, decoder] : decoders_) drivers::add(all, decoder->skipped());
  }

 private:
  std::string name_;
  decoders::Options options_;
  std::map<std::size_t, std::unique_ptr<drivers::OfflineDecoder>> decoders_;
};

int decode_file(const DecodeOptions& options) {
  Decoders decoders(options);
  const auto capture = read_capture(options);
  const auto style = options.json  ? decode::Style::json
                     : options.csv ? decode::Style::csv
                                   : decode::Style::human;
  const auto output = decode::make_output(style, stdout, stderr);
  decode::Totals totals;
  for (const auto& piece : capture.pieces)
    decoders.of(piece.conversation)
        .feed({piece.t_s, piece.from_device, piece.bytes, piece.can_id, piece.can_extended,
               piece.can_remote},
              [&](const drivers::Message& message) {
                ++totals.messages;
                output->message(message);
              });
  totals.skipped = capture.skipped;
  decoders.add_skipped(totals.skipped);
  output->end(totals);
  if (totals.messages > 0) return kFine;
  fmt::print(
      stderr,
      "vantage: {}: no message of {} (read as {}); see --format, --port, --swap and DEVICE\n",
      options.file.string(), options.device, captures::name(capture.format));
  return kFailed;
}

std::string device_help() {
  std::string text = "Devices:\n";
  for (const auto& device : decoders::devices())
    text += fmt::format("  {:<10} {}{}\n", device.name, device.what,
                        device.needs_metadata ? "; needs --metadata" : "");
  return text;
}

}  // namespace

void add_decode_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<DecodeOptions>();
  auto* command =
      app.add_subcommand("decode", "Prints every message of a device that is in a capture");
  command->footer(device_help() +
                  "Examples:\n"
                  "  candump -ta can0 > drive.log; vantage decode agilex drive.log\n"
                  "  vantage decode modbus battery.pcapng --port 502 --json\n"
                  "Exit: 0 fine, 1 no message of the device in the file, 2 refused.");
  command->add_option("device", options->device, "Which device")->required();
  command->add_option("file", options->file, "pcap, pcapng, tshark JSON, candump, socat -x or raw")
      ->required();
  command->add_option("--format", options->format,
                      "How to read the file: detect, pcap, json, candump, socat, raw");
  command->add_option("--port", options->port, "Only UDP and TCP with this port");
  command->add_option("--metadata", options->metadata, "The sensor's own description (JSON)");
  command->add_flag("--swap", options->swap, "The device is the other side of the conversation");
  auto* json = command->add_flag("--json", options->json, "One JSON object per line");
  command->add_flag("--csv", options->csv, "One row per value")->excludes(json);
  command->callback([options, &run] {
    // Errors are on stderr only: stdout holds one message a line.
    run = [options] { return answer(false, [&] { return decode_file(*options); }); };
  });
}

}  // namespace vantage
