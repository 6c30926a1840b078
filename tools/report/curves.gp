# Threshold curves. usage: gnuplot -e "data='CSV'; label='x axis'; out='SVG'" curves.gp
set datafile separator ','
set terminal svg size 520,360 font 'sans,11' noenhanced background rgb 'white'
set grid lc rgb '#dddddd'
set key bottom center
set output out
set xlabel label
set yrange [0:1.02]
plot data skip 1 using 1:2 with linespoints lw 2 pt 7 ps 0.5 title 'IoU', \
     data skip 1 using 1:3 with linespoints lw 2 pt 7 ps 0.5 title 'precision', \
     data skip 1 using 1:4 with linespoints lw 2 pt 7 ps 0.5 dt 2 title 'recall'
