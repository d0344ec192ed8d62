# A page to send.
#
# One file that opens in any browser: the light follows the mouse or a finger, a drag turns the object.
# It asks for nothing from outside, so it can be mailed; the picture is what Chromium shows. `sh page.sh FOLDER` makes
# one of your own frame.

pointshade render "${1:-vase}" -o page.html --title "Move the light" --background white --ambient 0.2
