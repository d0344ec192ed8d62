# A page to send.
#
# One file that opens in any browser: the light follows the mouse or a finger, a drag turns the object.
# It asks for nothing from outside, so it can be mailed; the picture is what Chromium shows.

pointshade render vase -o page.html --title "A vase of flowers" --background white --ambient 0.2
