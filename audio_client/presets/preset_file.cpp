#include "audio_client/presets/preset_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "audio_client/presets/preset_fields.hpp"
#include "common/core/bounded_text.hpp"
#include "common/sound/transients.hpp"

namespace osteon::audio {
namespace {

constexpr std::array<std::string_view, 3> kDrives = {"rotation", "strokes", "blows"};
constexpr std::array<std::string_view, kLineSources> kSourceNames = {"shaft",       "motor", "motor-mesh",
                                                                     "output-mesh", "teeth", "body"};

// Thrown while reading, caught in parse_preset().
struct PresetFault {
  std::string what;
};

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

template <class Names>
std::string one_of(const Names& names) {
  std::string all;
  for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + std::string(name);
  return all;
}

// A map of a preset. Each field that is read is crossed off, and what is left at the end is refused.
class MapReader {
 public:
  MapReader(const YAML::Node& node, std::string path) : path_(std::move(path)) {
    if (!node.IsMap()) throw PresetFault{where("") + "must be lines such as \"hz: 200\""};
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) throw PresetFault{where("") + "has a field whose name is no text; remove it"};
      const std::string key = entry.first.Scalar();
      if (std::ranges::any_of(fields_, [&](const Field& field) { return field.key == key; }))
        throw PresetFault{where(key) + "is there twice; remove one"};
      fields_.push_back({key, entry.second});
    }
  }

  void finish() const {
    const auto left = std::ranges::find(fields_, false, &Field::taken);
    if (left == fields_.end()) return;
    throw PresetFault{where(left->key) + "is not known here; remove it or choose one of " + one_of(known_)};
  }

  [[nodiscard]] std::optional<YAML::Node> take(const std::string& key) {
    known_.push_back(key);
    const auto at = std::ranges::find(fields_, key, &Field::key);
    if (at == fields_.end()) return std::nullopt;
    at->taken = true;
    return at->node;
  }
  [[nodiscard]] YAML::Node need(const std::string& key, const char* remedy) {
    const std::optional<YAML::Node> node = take(key);
    if (!node) throw PresetFault{where(key) + "is missing; " + remedy};
    return *node;
  }

  [[nodiscard]] std::string where(const std::string& key) const {
    const std::string full = path_ + (path_.empty() || key.empty() ? "" : ".") + key;
    return full.empty() ? "it " : "\"" + bounded_text(full, 80) + "\" ";
  }
  [[nodiscard]] std::string text_of(const YAML::Node& node, const std::string& key) const {
    if (!node.IsScalar()) throw PresetFault{where(key) + "must be a single value"};
    return node.Scalar();
  }
  [[nodiscard]] double number_of(const YAML::Node& node, const std::string& key, double low, double high) const {
    const std::string text = text_of(node, key);
    double value = 0;
    const char* from = text.data() + (text.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(from, text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= low && value <= high))
      throw PresetFault{where(key) + "is \"" + bounded_text(text, 40) + "\"; write a number from " + short_number(low) +
                        " to " + short_number(high)};
    return value;
  }

  void number(const char* key, double& value, double low, double high) {
    if (const auto node = take(key)) value = number_of(*node, key, low, high);
  }
  void whole(const char* key, int& value, int low, int high) {
    const auto node = take(key);
    if (!node) return;
    const double number = number_of(*node, key, low, high);
    if (number != std::floor(number)) throw PresetFault{where(key) + "is no whole number; write one such as 12"};
    value = static_cast<int>(number);
  }
  template <class Part>
  void map(const char* key, Part& part) {
    const auto node = take(key);
    if (!node) return;
    MapReader inside(*node, path_ + (path_.empty() ? "" : ".") + key);
    describe(inside, part);
    inside.finish();
  }
  template <class Part>
  void list(const char* key, std::vector<Part>& parts, std::size_t least, std::size_t most) {
    each(key, least, most, [&](MapReader& inside) {
      Part part;
      describe(inside, part);
      parts.push_back(part);
    });
  }
  // `read` takes the reader of one entry.
  template <class Read>
  void each(const char* key, std::size_t least, std::size_t most, const Read& read) {
    const auto node = take(key);
    if (!node) return;
    if (!node->IsSequence() || node->size() < least || node->size() > most)
      throw PresetFault{where(key) + "must be a list of " + std::to_string(least) + " to " + std::to_string(most) +
                        " entries"};
    std::size_t index = 0;
    for (const YAML::Node& entry : *node) {
      MapReader inside(entry, path_ + (path_.empty() ? "" : ".") + key + "[" + std::to_string(index++) + "]");
      read(inside);
      inside.finish();
    }
  }

 private:
  struct Field {
    std::string key;
    YAML::Node node;  // never assigned: that would change the document
    bool taken = false;
  };
  std::string path_;
  std::vector<Field> fields_;
  std::vector<std::string> known_;
};

LineSource source_of(const MapReader& in, const YAML::Node& node, const std::string& key) {
  const std::string name = in.text_of(node, key);
  const auto at = std::ranges::find(kSourceNames, std::string_view(name));
  if (at == kSourceNames.end())
    throw PresetFault{in.where(key) + "is \"" + bounded_text(name, 40) + "\"; choose one of " + one_of(kSourceNames)};
  return static_cast<LineSource>(at - kSourceNames.begin());
}

// A part of the tool that a line may be given by: its order, that of its sidebands, and its source.
struct GearPart {
  std::string_view name;
  double order, side;
  LineSource source;
};

std::array<GearPart, 7> gear_parts(const ToolModel& model) {
  const sound::Gearbox& gears = model.gears;
  const double motor = model.geared ? gears.motor() : model.motor.reduction;
  return {{{"shaft", 1.0, 1.0, LineSource::shaft},
           {"transfer", model.geared ? gears.transfer() : 1.0, 1.0, LineSource::shaft},
           {"motor", motor, 1.0, LineSource::shaft},
           {"commutation", model.segments * motor, motor, LineSource::motor},
           {"output-mesh", gears.output_mesh(), gears.output_spin(), LineSource::output_mesh},
           {"motor-mesh", gears.motor_mesh(), gears.motor_spin(), LineSource::motor_mesh},
           {"teeth", 0.0, 1.0, LineSource::teeth}}};
}

void read_line(MapReader& in, ToolModel& model) {
  Line line;
  const auto order = in.take("order"), of = in.take("of"), source = in.take("source");
  if (order.has_value() == of.has_value())
    throw PresetFault{in.where("order") + "or \"of\" must be there, and only one of them"};
  double times = 1, side = 0;
  if (of) {
    in.number("times", times, 0.01, 1000.0);
    in.number("side", side, -20.0, 20.0);
    const auto parts = gear_parts(model);
    const std::string name = in.text_of(*of, "of");
    const auto part = std::ranges::find(parts, std::string_view(name), &GearPart::name);
    if (part == parts.end() || (!model.geared && name.ends_with("mesh")))
      throw PresetFault{in.where("of") + "is \"" + bounded_text(name, 40) +
                        "\"; choose shaft, motor, commutation or teeth, or, if there are \"gears\", transfer, "
                        "output-mesh or motor-mesh"};
    line.order = times * part->order + side * part->side;
    line.source = part->source;
    if (part->source == LineSource::teeth) line.teeth = times;
  } else {
    line.order = in.number_of(*order, "order", 0.001, 10000.0);
  }
  if (source) line.source = source_of(in, *source, "source");
  // Tools have two teeth or more.
  if (const double least = line.order + 2.0 * line.teeth; !(least >= 0.001 && least <= 10000.0))
    throw PresetFault{in.where("of") + "gives an order below 0.001 or above 10000; change \"times\" or \"side\""};
  line.level_db = in.number_of(in.need("level_db", "write the level, such as -40"), "level_db", kNoLevel_db, 0.0);
  model.lines.push_back(line);
}

void read_names(MapReader& in, ToolModel& model) {
  model.name = in.text_of(in.need("name", "write one such as my-drill"), "name");
  if (model.name.empty() || model.name.size() > 60 || bounded_text(model.name) != model.name)
    throw PresetFault{in.where("name") + "must have 1 to 60 letters in one line"};
  model.title = model.name;
  if (const auto title = in.take("title")) model.title = bounded_text(in.text_of(*title, "title"), 200);
  const YAML::Node tools = in.need("tools", "list kinds of tools, or names, such as [drill, end-drill]");
  if (!tools.IsSequence() || tools.size() == 0 || tools.size() > 100)
    throw PresetFault{in.where("tools") + "must be a list of 1 to 100 kinds or names of tools"};
  for (const YAML::Node& tool : tools) model.tools.push_back(in.text_of(tool, "tools"));
  const std::string drive = in.text_of(in.need("drive", "choose rotation, strokes or blows"), "drive");
  const auto known = std::ranges::find(kDrives, std::string_view(drive));
  if (known == kDrives.end())
    throw PresetFault{in.where("drive") + "is \"" + bounded_text(drive, 40) + "\"; choose one of " + one_of(kDrives)};
  model.drive = static_cast<Drive>(known - kDrives.begin());
}

void read_transients(MapReader& in, ToolModel& model) {
  in.number("recorded_s", model.recorded_s, 0.0, 300.0);
  const auto node = in.take("transients");
  if (!node) return;
  if (!node->IsSequence() || node->size() > kMostTransients)
    throw PresetFault{in.where("transients") + "must be a list of at most " + std::to_string(kMostTransients)};
  const auto longest = static_cast<std::size_t>(sound::kLongestTransient_s * kPresetTransientRate_hz);
  std::size_t all = 0;
  for (const YAML::Node& entry : *node) {
    YAML::Binary bytes;
    const bool decoded = entry.IsScalar() && YAML::convert<YAML::Binary>::decode(entry, bytes);
    if (!decoded || bytes.size() < 2 || bytes.size() % 2 != 0 || bytes.size() / 2 > longest)
      throw PresetFault{in.where("transients") + "must hold 1 to " + std::to_string(longest) +
                        " samples of 16 bits each, which is 20 ms; shorten it"};
    std::vector<float> samples(bytes.size() / 2);
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples[i] =
          static_cast<float>(static_cast<std::int16_t>(bytes.data()[2 * i] | bytes.data()[2 * i + 1] << 8)) / 32768.0F;
    all += samples.size();
    model.transients.push_back(std::move(samples));
  }
  if (static_cast<double>(all) > sound::kMostTransientPart * model.recorded_s * kPresetTransientRate_hz)
    throw PresetFault{in.where("transients") + "hold more than a tenth of \"recorded_s\"; remove some"};
}

ToolModel read_model(const YAML::Node& root) {
  MapReader in(root, "");
  ToolModel model;
  read_names(in, model);
  model.rated_rpm =
      in.number_of(in.need("rated_rpm", "write the speed that the levels are for"), "rated_rpm", 1.0, 200000.0);
  in.whole("teeth", model.teeth, 0, 1000);
  in.whole("segments", model.segments, 1, 100);
  if (const auto gears = in.take("gears")) {
    MapReader inside(*gears, "gears");
    describe(inside, model.gears);
    inside.finish();
    model.geared = true;
    model.motor.reduction = model.gears.motor();
  }
  in.map("motor", model.motor);
  in.each("lines", 0, kMostLines, [&](MapReader& line) { read_line(line, model); });
  in.list("noise", model.noise, 2, kMostNoisePoints);
  if (std::ranges::adjacent_find(model.noise, std::ranges::greater_equal{}, &NoisePoint::hz) != model.noise.end())
    throw PresetFault{in.where("noise") + "must go from low to high \"hz\", each higher than the one before"};
  in.map("chips", model.chips);
  in.map("cancellous", model.cancellous);
  in.map("cortical", model.cortical);
  if (!(model.cancellous.density_g_cm3 < model.cortical.density_g_cm3))
    throw PresetFault{in.where("cancellous.density_g_cm3") + "must be below that of \"cortical\"; lower it"};
  in.map("perforation", model.perforation);
  in.map("plate", model.plate);
  in.map("blade", model.blade);
  in.map("blow", model.blow);
  read_transients(in, model);
  in.finish();
  return model;
}

// Writes what MapReader reads.
class MapWriter {
 public:
  explicit MapWriter(YAML::Emitter& out) : out_(out) {}

  void number(const char* key, double value, double /*low*/, double /*high*/) {
    const bool level = std::string_view(key).find("db") != std::string_view::npos;
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), level ? "%.2f" : "%.7g", value);
    out_ << YAML::Key << key << YAML::Value << text.data();
  }
  void whole(const char* key, int value, int /*low*/, int /*high*/) {
    out_ << YAML::Key << key << YAML::Value << value;
  }
  template <class Part>
  void map(const char* key, Part& part) {
    out_ << YAML::Key << key << YAML::Value << YAML::BeginMap;
    describe(*this, part);
    out_ << YAML::EndMap;
  }
  template <class Part>
  void list(const char* key, std::vector<Part>& parts, std::size_t /*least*/, std::size_t /*most*/) {
    if (parts.empty()) return;
    out_ << YAML::Key << key << YAML::Value << YAML::BeginSeq;
    for (Part& part : parts) {
      out_ << YAML::Flow << YAML::BeginMap;
      describe(*this, part);
      out_ << YAML::EndMap;
    }
    out_ << YAML::EndSeq;
  }

 private:
  YAML::Emitter& out_;
};

void write_lines(MapWriter& writer, YAML::Emitter& out, const ToolModel& model) {
  if (model.lines.empty()) return;
  out << YAML::Key << "lines" << YAML::Value << YAML::BeginSeq;
  for (const Line& line : model.lines) {
    out << YAML::Flow << YAML::BeginMap;
    if (line.teeth == 0) {
      writer.number("order", line.order, 0, 0);
    } else {
      out << YAML::Key << "of" << YAML::Value << "teeth";
      writer.number("times", line.teeth, 0, 0);
      if (line.order != 0) writer.number("side", line.order, 0, 0);
    }
    out << YAML::Key << "source" << YAML::Value << std::string(source_name(line.source));
    writer.number("level_db", line.level_db, 0, 0);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

void write_transients(MapWriter& writer, YAML::Emitter& out, const ToolModel& model) {
  if (model.recorded_s > 0) writer.number("recorded_s", model.recorded_s, 0, 0);
  if (model.transients.empty()) return;
  out << YAML::Key << "transients" << YAML::Value << YAML::BeginSeq;
  for (const std::vector<float>& samples : model.transients) {
    std::vector<unsigned char> bytes;
    for (const float x : samples) {
      const auto bits = static_cast<std::uint16_t>(
          static_cast<std::int16_t>(std::lround(std::clamp(32768.0F * x, -32768.0F, 32767.0F))));
      bytes.push_back(static_cast<unsigned char>(bits & 0xFFU));
      bytes.push_back(static_cast<unsigned char>(bits >> 8U));
    }
    out << YAML::Binary(bytes.data(), bytes.size());
  }
  out << YAML::EndSeq;
}

}  // namespace

std::string_view source_name(LineSource source) { return kSourceNames[static_cast<std::size_t>(source)]; }

Result<ToolModel> parse_preset(std::string_view text, const std::string& file) {
  try {
    return read_model(YAML::Load(std::string(text)));
  } catch (const PresetFault& fault) {
    return bad_input(file + ": " + fault.what);
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? std::string() : ", line " + std::to_string(error.mark.line + 1);
    return bad_input(file + line + ": this is not YAML (" + bounded_text(error.msg, 80) +
                     "); write lines such as rated_rpm: 1400");
  }
}

std::string to_yaml(const ToolModel& model) {
  ToolModel m = model;
  YAML::Emitter out;
  MapWriter writer(out);
  out << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << m.name;
  out << YAML::Key << "title" << YAML::Value << YAML::DoubleQuoted << m.title;
  out << YAML::Key << "tools" << YAML::Value << YAML::Flow << m.tools;
  out << YAML::Key << "drive" << YAML::Value << std::string(kDrives[static_cast<std::size_t>(m.drive)]);
  writer.number("rated_rpm", m.rated_rpm, 0, 0);
  writer.whole("teeth", m.teeth, 0, 0);
  writer.whole("segments", m.segments, 0, 0);
  if (m.geared) writer.map("gears", m.gears);
  writer.map("motor", m.motor);
  write_lines(writer, out, m);
  writer.list("noise", m.noise, 0, 0);
  writer.map("chips", m.chips);
  writer.map("cancellous", m.cancellous);
  writer.map("cortical", m.cortical);
  writer.map("perforation", m.perforation);
  writer.map("plate", m.plate);
  writer.map("blade", m.blade);
  writer.map("blow", m.blow);
  write_transients(writer, out, m);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

const ToolModel* preset_for(const std::vector<ToolModel>& presets, std::string_view tool_name,
                            std::string_view tool_kind) {
  for (const std::string_view wanted : {tool_name, tool_kind})
    for (const ToolModel& model : presets)
      if (std::ranges::find(model.tools, wanted) != model.tools.end()) return &model;
  return nullptr;
}

}  // namespace osteon::audio
