#include "server/import/report_html.hpp"

#include <sodium.h>

#include <array>
#include <cstdio>

namespace osteon::import {
namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>Import report</title>
<style>
body { font: 15px/1.45 sans-serif; color: #16181c; max-width: 62rem; margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin: 0; }
h2 { font-size: 1.15rem; margin: 1.6rem 0 0.5rem; }
img { max-width: 100%; height: auto; }
table { border-collapse: collapse; }
th, td { text-align: left; padding: 0.25rem 0.9rem 0.25rem 0; vertical-align: middle; border-bottom: 1px solid #ddd; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; }
td img { width: 75px; display: block; }
.swatch { display: inline-block; width: 0.9em; height: 0.9em; margin-right: 0.4em; }
.out { color: #777; }
.risk { color: #b00020; font-weight: bold; }
.warning { background: #fff3cd; padding: 0.5rem 0.9rem; margin: 0.3rem 0; }
.note { color: #555; font-size: 0.9em; }
</style>
</head>
<body>
)";

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  return safe;
}

std::string number(const char* format, double value) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}
std::string number(const char* format, const std::optional<double>& value) {
  return value ? number(format, *value) : "–";
}

std::string image(const std::string& png, const std::string& what) {
  if (png.empty()) return "";
  std::string text(sodium_base64_ENCODED_LEN(png.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(png.data()), png.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  text.resize(text.size() - 1);  // its zero at the end
  return "<img alt=\"" + escaped(what) + "\" src=\"data:image/png;base64," + text + "\">";
}

std::string cell(const std::string& text) { return "<td>" + text + "</td>"; }
std::string number_cell(const std::string& text) { return "<td class=\"number\">" + text + "</td>"; }

std::string row(const std::string& name, const std::string& value) {
  return "<tr><th>" + name + "</th>" + cell(value) + "</tr>\n";
}

std::string summary(const ReportFacts& facts) {
  std::string text = "<table>\n";
  if (facts.bone_cm3)
    text +=
        row("Bone in the case",
            number("%.2f cm³", *facts.bone_cm3) +
                (facts.bone_density_g_cm3 ? ", mean density " + number("%.2f g/cm³", *facts.bone_density_g_cm3) : ""));
  if (facts.metal_cm3 > 0.0 || facts.enamel_cm3 > 0.0)
    text += row("Of that", number("%.2f cm³ metal, ", facts.metal_cm3) + number("%.2f cm³ enamel", facts.enamel_cm3));
  text += row("Source", escaped(facts.source));
  if (facts.threshold_hu) text += row("Threshold", number("%.0f HU", *facts.threshold_hu));
  if (facts.pitch_mm) text += row("Voxel edge of the case", number("%.3g mm", *facts.pitch_mm));
  return text + "</table>\n";
}

std::string state_of(const ReportPart& part) {
  if (part.at_risk) return "<span class=\"risk\">structure at risk</span>";
  if (!part.island || part.island->kind == imaging::IslandKind::bone) return part.kept ? "bone" : "left out";
  return part.kept ? "kept: " + likeness_of(part.island->kind) : "left out: " + words_of(part.island->kind);
}

Result<std::string> parts_table(const ReportFacts& facts) {
  std::string text =
      "<h2>Bones and structures</h2>\n<table>\n<tr><th></th><th class=\"number\">Number</th><th>Name</th>"
      "<th>What</th><th class=\"number\">Volume, cm³</th><th class=\"number\">Mean density, g/cm³</th>"
      "<th>Place</th><th>Centre, mm (LPS)</th></tr>\n";
  for (const ReportPart& part : facts.parts) {
    std::string picture;
    if (part.picture.width() > 0) {
      const auto png = part.picture.png();
      if (!png) return tl::unexpected(png.error());
      picture = image(*png, "from the front");
    }
    std::string name = escaped(part.name);
    if (part.colour) {
      std::array<char, 96> swatch{};
      std::snprintf(swatch.data(), swatch.size(), "<span class=\"swatch\" style=\"background:#%02x%02x%02x\"></span>",
                    part.colour->red, part.colour->green, part.colour->blue);
      name.insert(0, swatch.data());
    }
    if (!part.kind.empty() && part.kind != "bone") name += " (" + escaped(part.kind) + ")";
    std::array<char, 64> centre{};
    std::snprintf(centre.data(), centre.size(), "%.0f, %.0f, %.0f", part.centre_mm.x(), part.centre_mm.y(),
                  part.centre_mm.z());
    text += std::string(part.kept ? "<tr>" : "<tr class=\"out\">") + cell(picture) +
            number_cell(std::to_string(part.number)) + cell(name) + cell(state_of(part)) +
            number_cell(number("%.2f", part.volume_cm3)) + number_cell(number("%.2f", part.density_g_cm3)) +
            cell(escaped(part.place)) + cell(centre.data()) + "</tr>\n";
  }
  text += "</table>\n";
  for (const std::string& sentence : facts.unlisted) text += "<p>" + escaped(sentence) + "</p>\n";
  return text + "<p class=\"note\">Volume of the voxels. Density of bone from its HU, with marrow.</p>\n";
}

std::string comparison_table(const LabelComparison& comparison) {
  std::string text =
      "<h2>Compared with other labels</h2>\n<table>\n<tr><th>Label</th><th>With</th><th>Found by</th>"
      "<th class=\"number\">Dice</th><th class=\"number\">Mean distance, mm</th>"
      "<th class=\"number\">95 % distance, mm</th><th class=\"number\">Volume, cm³</th>"
      "<th class=\"number\">Its volume, cm³</th></tr>\n";
  for (const ComparedLabel& label : comparison.labels) {
    const bool found = !label.truth.empty();
    const std::string truth_cm3 = found ? number("%.2f", label.truth_cm3) : "–";
    text += "<tr>" + cell(escaped(label.name)) + cell(found ? escaped(label.truth) : "no such label") +
            cell(std::string(name_of(label.matched))) +
            number_cell(found ? number("%.4f", label.agreement.dice) : "–") +
            number_cell(number("%.3f", label.agreement.mean_mm)) +
            number_cell(number("%.3f", label.agreement.percentile95_mm)) +
            number_cell(number("%.2f", label.volume_cm3)) + number_cell(truth_cm3) + "</tr>\n";
  }
  text += "</table>\n";
  for (const std::string& name : comparison.missing) text += "<p>The case has no " + escaped(name) + ".</p>\n";
  return text +
         "<p class=\"note\">Dice: 1 is the same voxels, 0 none in common. Distances between the surfaces, both "
         "ways: their mean, and what 95 % of them do not exceed.</p>\n";
}

std::string steps_list(const ReportFacts& facts) {
  std::string text = "<h2>Steps</h2>\n<ol>\n";
  for (const ReportStep& step : facts.steps) {
    text += "<li><b>" + escaped(step.name) + "</b>: " + escaped(step.text);
    for (const auto& [name, value] : step.parameters) text += "; " + escaped(name) + number(" %.6g", value);
    text += "</li>\n";
  }
  return text + "</ol>\n";
}

std::string list_of(const std::string& title, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return "";
  std::string text = "<h2>" + title + "</h2>\n<ul>\n";
  for (const std::string& sentence : sentences) text += "<li>" + escaped(sentence) + "</li>\n";
  return text + "</ul>\n";
}

}  // namespace

Result<std::string> to_html(const ReportFacts& facts, const ReportImages& images) {
  std::string text = kHead;
  text += "<h1>Import report: " + escaped(facts.title) + "</h1>\n";
  for (const std::string& warning : facts.warnings)
    text += "<p class=\"warning\"><b>Warning:</b> " + escaped(warning) + "</p>\n";
  text += summary(facts);
  if (!images.montage.empty())
    text += "<h2>What was taken as bone</h2>\n" +
            image(images.montage, "Three planes of the scan with the outlines of the bones, and their surface") +
            "<p class=\"note\">Outlines show what is in the case. R and L are the patient's right and left, A front, P "
            "back, H head, F feet. Structures at risk shine through the bone.</p>\n";
  if (!images.islands.empty())
    text += "<h2>All islands of bone</h2>\n" + image(images.islands, "All islands from the front and from the left") +
            "<p class=\"note\">Grey islands were left out. Numbers are those of the table and of --keep.</p>\n";
  auto parts = parts_table(facts);
  if (!parts) return parts;
  text += *parts + list_of("Left out", facts.left_out);
  if (!images.histogram.empty())
    text += "<h2>Hounsfield units</h2>\n" + image(images.histogram, "Histogram of the HU with the threshold") +
            "<p class=\"note\">Voxels of each HU, in steps of 10. The height is the logarithm of their number.</p>\n";
  if (facts.comparison) text += comparison_table(*facts.comparison);
  text += steps_list(facts);
  if (!facts.hash.empty()) text += "<p class=\"note\">Hash of the case: " + facts.hash + "</p>\n";
  return text + "</body>\n</html>\n";
}

}  // namespace osteon::import
