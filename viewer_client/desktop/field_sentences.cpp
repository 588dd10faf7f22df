#include "viewer_client/desktop/field_sentences.hpp"

#include <QCoreApplication>
#include <QRegularExpression>
#include <cstddef>
#include <iterator>

namespace osteon {

namespace {

// The sentences are English, so what is written is, too. %1 to %5 are the fields, as kFields has them. Longer rules
// come first, since each is applied to what the others have left. An option begins a word: names of files may contain
// it.
struct FieldRule {
  const char *found, *written;
};
constexpr FieldRule kFieldRules[] = {
    // common/wire
    {"--certificates DIR with --ticket FILE, as whoever runs the server gives them to you, or --plain for a server on "
     "this machine",
     "fill in the fields %2 and %3, or leave both empty for a server on this machine"},
    {"but you gave --plain; give --certificates DIR with --ticket FILE in its place",
     "but the fields %2 and %3 are empty; fill in both"},
    {"give --plain in place of --certificates and --ticket, or start the server with --certificates",
     "empty the fields %2 and %3, or have the server started with certificates"},
    {"give --certificates DIR with --ticket FILE", "fill in the fields %2 and %3"},
    {"give with --certificates", "give in the field %2"},
    {"of a person with --certificates", "of a person in the field %2"},
    {"with --server", "in the field %1"},
    {"in --server", "in the field %1"},
    {"whether --server is", "whether the field %1 is"},
    {"--server ", "the server "},
    // osteon-import
    {", or take another series by --series N", ", or choose another series"},
    {", --spacing for PNG slices, or --size too for raw numbers", ""},
    {", or --size, --spacing and --type if it holds raw numbers", ""},
    {"take it with --keep, or give a lower --threshold or a higher --metal-hu", "choose a lower value in the field %4"},
    {"a lower --threshold or a smaller --pitch", "a lower value in the field %4"},
    {"a lower --threshold", "a lower value in the field %4"},
    {"another --threshold", "another value in the field %4"},
    {"give a larger --pitch", "draw a smaller box on the page of image processing"},
    {"choose a larger --pitch", "draw a smaller box on the page of image processing"},
    {"another --gaussian", "another value in the field %5"},
};

constexpr struct {
  const char *context, *words;
} kFields[] = {{"ServerFields", "Server, HOST:PORT"},
               {"ServerFields", "Folder of your certificate"},
               {"ServerFields", "File of your ticket"},
               {"ImagingPage", "Threshold"},
               {"ImagingPage", "Smoothing"}};

}  // namespace

QString with_fields(const QString& sentence) {
  if (!sentence.contains("--")) return sentence;
  QString shown = sentence;
  for (const FieldRule& rule : kFieldRules) {
    QString written = rule.written;
    for (std::size_t i = 0; i < std::size(kFields); ++i)
      written.replace('%' + QString::number(i + 1),
                      "“" + QCoreApplication::translate(kFields[i].context, kFields[i].words) + "”");
    const QString found = QRegularExpression::escape(rule.found);
    shown.replace(QRegularExpression(found.startsWith("\\-") ? "(?<!\\S)" + found : found), written);
  }
  return shown;
}

QString sentence_of(const Error& error) { return with_fields(QString::fromStdString(error.message)); }

}  // namespace osteon
